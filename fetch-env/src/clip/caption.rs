use font8x8::legacy::BASIC_LEGACY;

/// What is written on a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Caption {
    /// Steps since the reset.
    pub step: u32,
    /// The reward of the last step.
    pub reward: f64,
    /// Distance between achieved and desired goal, in meters.
    pub distance: f64,
}

/// Side of a letter in the font, in dots.
const LETTER: usize = 8;
/// Widths at which letters of this many pixels a dot still leave most of the frame free.
const PIXELS_PER_DOT: usize = 240;

impl Caption {
    fn lines(&self) -> [String; 3] {
        [
            format!("step     {:3}", self.step),
            format!("reward   {:6.3}", self.reward + 0.0), // not -0
            format!("distance {:6.3} m", self.distance),
        ]
    }

    /// Writes the lines in white on the darkened upper left corner, as far as there is room.
    pub(super) fn draw(&self, rgb: &mut [u8], width: usize) {
        let scale = (width / PIXELS_PER_DOT).max(1);
        let lines = self.lines();
        let letters = lines.iter().map(String::len).max().unwrap_or(0);
        let (margin, line) = (LETTER / 2 * scale, (LETTER + 2) * scale);
        let (right, bottom) =
            (2 * margin + letters * LETTER * scale, 2 * margin + lines.len() * line);
        for (y, row) in rgb.chunks_exact_mut(3 * width).enumerate().take(bottom) {
            for (x, pixel) in row.chunks_exact_mut(3).enumerate().take(right) {
                let dot = x.checked_sub(margin).zip(y.checked_sub(margin)).is_some_and(|(x, y)| {
                    let text = lines.get(y / line).map_or("", String::as_str);
                    is_dot(text, x / scale, y % line / scale)
                });
                for value in pixel {
                    *value = if dot { 255 } else { *value / 3 };
                }
            }
        }
    }
}

/// Whether a text has a dot there, counted from its upper left corner.
fn is_dot(text: &str, x: usize, y: usize) -> bool {
    let letter = text.as_bytes().get(x / LETTER).copied().unwrap_or(b' ');
    let rows = BASIC_LEGACY.get(usize::from(letter)).unwrap_or(&BASIC_LEGACY[0]);
    rows.get(y).is_some_and(|row| row >> (x % LETTER) & 1 == 1)
}
