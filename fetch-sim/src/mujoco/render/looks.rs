//! What pictures show otherwise than the model.

use std::ffi::c_int;

use super::super::binding::{
    ffi::{
        FS_SEGMENT_GEOM, FS_SEGMENT_SITE,
        ModelArray::{GeomBodyid, SiteBodyid},
        RawLook, RawLooks,
    },
    ids::SiteId,
    model::Model,
};
use crate::{
    looks::{LookFactor as Factor, Looks},
    task::Task,
};

/// The looks of a renderer's next pictures.
#[derive(Debug)]
pub(super) struct ShownLooks {
    pub(super) looks: Looks,
    /// Whether goals are drawn, if the looks do not hide them.
    pub(super) goals_shown: bool,
    /// The scale of the object's size.
    pub(super) object_size: f64,
    parts: Vec<Part>,
    changed: Vec<RawLook>,
}

/// A geom or a site that may look otherwise.
#[derive(Debug)]
struct Part {
    kind: c_int,
    id: usize,
    color: [Factor; 3],
}

/// The color of a goal's sphere without a site, as of the built-in model's site.
const RED: [f32; 3] = [1.0, 0.0, 0.0];

impl ShownLooks {
    /// Finds the parts of a model, of which any may be missing.
    pub(super) fn new(model: &Model, task: Task, targets: &[Option<SiteId>]) -> Self {
        let mut parts = Vec::new();
        let mut add = |kind, ids: Vec<usize>, color| {
            parts.extend(ids.into_iter().map(|id| Part { kind, id, color }));
        };
        let object = model.site("object0").and_then(|site| model.site_body(site));
        if let (true, Ok(object)) = (task.has_object(), object) {
            add(FS_SEGMENT_GEOM, model.fixed_to(GeomBodyid, object), Factor::OBJECT_COLOR);
            // Its site is a ball within it.
            add(FS_SEGMENT_SITE, model.fixed_to(SiteBodyid, object), Factor::OBJECT_COLOR);
        }
        if let Ok(table) = model.body("table0") {
            add(FS_SEGMENT_GEOM, model.fixed_to(GeomBodyid, table), Factor::TABLE_COLOR);
        }
        let floor = model.geom("floor0").map(|geom| geom.0);
        add(FS_SEGMENT_GEOM, floor.into_iter().collect(), Factor::FLOOR_COLOR);
        let targets = targets.iter().flatten().map(|site| site.0);
        add(FS_SEGMENT_SITE, targets.collect(), Factor::GOAL_COLOR);
        let looks = Looks::default();
        Self { looks, goals_shown: true, object_size: 1.0, parts, changed: Vec::new() }
    }

    /// Returns whether goals are drawn.
    pub(super) fn shows_goals(&self) -> bool {
        self.goals_shown && self.or(Factor::GoalVisible, 1.0) >= 0.5
    }

    /// Returns the color of the goals that have no site.
    pub(super) fn goal_color(&self) -> [f32; 3] {
        let color = self.color(Factor::GOAL_COLOR);
        std::array::from_fn(|i| if color[i].is_nan() { RED[i] } else { color[i] })
    }

    /// Returns what differs from the model, if anything does. It borrows from `self`.
    pub(super) fn raw(&mut self) -> Option<RawLooks> {
        if self.looks.is_empty() && self.object_size == 1.0 && self.goals_shown {
            return None;
        }
        let mut changed = std::mem::take(&mut self.changed);
        changed.clear();
        changed.extend(self.parts.iter().map(|part| RawLook {
            kind: part.kind,
            id: part.id as c_int,
            color: self.color(part.color),
            scale: match part.color {
                Factor::OBJECT_COLOR => self.object_size as f32,
                Factor::GOAL_COLOR if !self.shows_goals() => 0.0,
                _ => 1.0,
            },
        }));
        self.changed = changed;
        let or = |factor, otherwise| self.or(factor, otherwise);
        let radians = |factor, otherwise: f64| or(factor, otherwise).to_radians();
        Some(RawLooks {
            objects: self.changed.as_ptr(),
            count: self.changed.len() as c_int,
            light: [
                radians(Factor::LightAzimuth, f64::NAN),
                radians(Factor::LightElevation, f64::NAN),
                or(Factor::LightIntensity, f64::NAN),
            ],
            moved: [Factor::CameraRight, Factor::CameraUp, Factor::CameraForward]
                .map(|factor| or(factor, 0.0)),
            turned: [Factor::CameraPan, Factor::CameraTilt].map(|factor| radians(factor, 0.0)),
            field: or(Factor::CameraFieldOfView, 1.0),
        })
    }

    fn or(&self, factor: Factor, otherwise: f64) -> f64 {
        self.looks.get(factor).unwrap_or(otherwise)
    }

    /// Returns a color; NaN where it is the model's.
    fn color(&self, color: [Factor; 3]) -> [f32; 3] {
        color.map(|factor| self.or(factor, f64::NAN) as f32)
    }
}
