//! The results as tables, CSV and named figures.

use std::fmt::Write as _;

use baselines::robustness::{RobustnessCurve, SuccessAt};
use baselines::{Estimate, Summary};

use super::Args;
use super::measured::{CRITICAL, Measured, Pair, Rates, TIMES, by_factor};
use crate::shared::json::Metric;

/// Prints a table for each curve, and what sums it up, and then the means and the pairs.
pub fn print(
    args: &Args,
    measured: &[Measured],
    means: &[Rates],
    pairs: &[Pair],
) -> anyhow::Result<()> {
    for Measured { policy, curve } in measured {
        let factor = &curve.factor;
        say!(
            "{}, {policy}, {} episodes for each value; 95 % intervals",
            args.env_id,
            args.episodes.episodes
        )?;
        say!(
            "| {factor} | success at the end | success at any time | final distance (m) |\n|---|---|---|---|"
        )?;
        for point in &curve.points {
            let [end, any, distance] = [
                point.summary.success_rate,
                point.summary.success_any_rate,
                point.summary.final_distance_mean,
            ];
            say!("| {} | {} | {} | {:.3} |", point.value, rate(end), rate(any), distance.value)?;
        }
        for (name, at) in TIMES {
            say!("success at {name}: {}", sums(curve, at))?;
        }
        say!("")?;
    }
    for (means, measured) in means.iter().zip(by_factor(measured)) {
        let (name, factor) = (&means.policy, &measured[0].curve.factor);
        say!("{}, {name}; 95 % intervals", args.env_id)?;
        say!("| {factor} | success at the end | success at any time |\n|---|---|---|")?;
        for ((value, end), (_, any)) in means.end.iter().zip(&means.any) {
            say!("| {value} | {} | {} |", rate(*end), rate(*any))?;
        }
        say!("")?;
    }
    for Pair { policy, factors: [rows, columns], cells } in pairs {
        say!("{}, {policy}, success at the end; 95 % intervals", args.env_id)?;
        let head: String = columns.values.iter().map(|value| format!(" {value} |")).collect();
        let rule = "---|".repeat(columns.values.len());
        say!("| {} \\ {} |{head}\n|---|{rule}", rows.factor, columns.factor)?;
        for (value, cells) in rows.values.iter().zip(cells.chunks(columns.values.len())) {
            let cells = cells.iter().map(|cell| format!(" {} |", rate(cell.success_rate)));
            say!("| {value} |{}", cells.collect::<String>())?;
        }
        say!("")?;
    }
    Ok(())
}

/// Returns what sums a curve up.
pub fn sums(curve: &RobustnessCurve, at: SuccessAt) -> String {
    let critical = match curve.critical_value(at, CRITICAL) {
        Some(value) => format!("below {CRITICAL} at {value}"),
        None => format!("never below {CRITICAL}"),
    };
    // One value has neither a slope nor an area.
    match curve.points.len() {
        ..2 => critical,
        _ => format!("{critical}, slope {:.3}, area {:.4}", curve.slope(at), curve.area(at)),
    }
}

/// Returns a rate and its interval.
pub fn rate(rate: Estimate) -> String {
    format!("{:.2} ({:.2} to {:.2})", rate.value, rate.low, rate.high)
}

/// Returns all curves, a line for each value.
pub fn csv(measured: &[Measured]) -> anyhow::Result<String> {
    let mut text = "policy,factor,value,success_rate,success_rate_low,success_rate_high,\
                    success_any_rate,success_any_rate_low,success_any_rate_high,final_distance\n"
        .to_owned();
    for Measured { policy, curve } in measured {
        for point in &curve.points {
            let (end, any) = (point.summary.success_rate, point.summary.success_any_rate);
            let distance = point.summary.final_distance_mean.value;
            writeln!(
                text,
                "{},{},{},{},{},{},{},{},{},{distance}",
                quoted(policy),
                quoted(&curve.factor),
                point.value,
                end.value,
                end.low,
                end.high,
                any.value,
                any.low,
                any.high,
            )?;
        }
    }
    Ok(text)
}

/// Returns a field as CSV has it.
fn quoted(field: &str) -> String {
    if field.contains([',', '"', '\n']) {
        return format!("\"{}\"", field.replace('"', "\"\""));
    }
    field.to_owned()
}

/// Returns all figures, with their names.
pub fn figures(measured: &[Measured], pairs: &[Pair]) -> Vec<(String, Metric)> {
    let mut figures: Vec<_> = measured.iter().flat_map(figures_of_curve).collect();
    for Pair { policy, factors: [rows, columns], cells } in pairs {
        for (value, cells) in rows.values.iter().zip(cells.chunks(columns.values.len())) {
            for (other, cell) in columns.values.iter().zip(cells) {
                let name = format!(
                    "robustness/{policy}/{}={value}/{}={other}",
                    rows.factor, columns.factor
                );
                figures.extend(rates(&name, cell));
            }
        }
    }
    figures
}

/// Returns the figures of both success rates.
pub fn rates(name: &str, summary: &Summary) -> [(String, Metric); 2] {
    let figures =
        [("success_rate", summary.success_rate), ("success_any_rate", summary.success_any_rate)];
    figures.map(|(figure, rate)| (format!("{name}/{figure}"), Metric::new(rate.value, "1")))
}

fn figures_of_curve(Measured { policy, curve }: &Measured) -> Vec<(String, Metric)> {
    let name = format!("robustness/{policy}/{}", curve.factor);
    let mut figures = Vec::new();
    for point in &curve.points {
        figures.extend(rates(&format!("{name}/{}", point.value), &point.summary));
    }
    for (at, suffix) in [(SuccessAt::End, "success_rate"), (SuccessAt::AnyTime, "success_any_rate")]
    {
        figures.push((format!("{name}/{suffix}/area"), Metric::new(curve.area(at), "1")));
        figures.push((format!("{name}/{suffix}/slope"), Metric::new(curve.slope(at), "1")));
        if let Some(value) = curve.critical_value(at, CRITICAL) {
            figures.push((format!("{name}/{suffix}/critical"), Metric::new(value, "1")));
        }
    }
    figures.retain(|(_, figure)| figure.value.is_finite());
    figures
}
