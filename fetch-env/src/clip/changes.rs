use std::ops::Range;

/// The part of a frame that differs from the one before, in pixels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Rectangle {
    pub(super) x: Range<usize>,
    pub(super) y: Range<usize>,
}

impl Rectangle {
    /// The smallest that holds all pixels in which two pictures of `width` differ; one pixel if
    /// they do not, as a frame must have some.
    pub(super) fn of_changes<T: PartialEq>(before: &[T], after: &[T], width: usize) -> Self {
        let rows = || before.chunks_exact(width).zip(after.chunks_exact(width)).enumerate();
        let mut changed = rows().filter(|(_, (before, after))| before != after).map(|(y, _)| y);
        let Some(top) = changed.next() else { return Self { x: 0..1, y: 0..1 } };
        let y = top..changed.last().unwrap_or(top) + 1;
        let mut x = width..0;
        for (_, (before, after)) in rows().take(y.end).skip(y.start) {
            let differs = |&column: &usize| before[column] != after[column];
            x.start = (0..x.start).find(differs).unwrap_or(x.start);
            x.end = (x.end..width).rfind(differs).map_or(x.end, |column| column + 1);
        }
        Self { x, y }
    }

    /// The pixels of a picture of `width` that lie in it, row by row.
    pub(super) fn cut<'a, T: Copy>(
        &'a self,
        picture: &'a [T],
        width: usize,
    ) -> impl Iterator<Item = T> + 'a {
        let rows = picture.chunks_exact(width).skip(self.y.start).take(self.y.len());
        rows.flat_map(|row| row[self.x.clone()].iter().copied())
    }
}

#[cfg(test)]
mod tests {
    use super::Rectangle;

    #[test]
    fn the_rectangle_holds_all_changes_and_no_more() {
        let before = [0; 20];
        let mut after = before;
        assert_eq!(Rectangle::of_changes(&before, &after, 5), Rectangle { x: 0..1, y: 0..1 });
        after[7] = 1; // row 1, column 2
        assert_eq!(Rectangle::of_changes(&before, &after, 5), Rectangle { x: 2..3, y: 1..2 });
        after[16] = 2; // row 3, column 1
        after[13] = 3; // row 2, column 3
        let changes = Rectangle::of_changes(&before, &after, 5);
        assert_eq!(changes, Rectangle { x: 1..4, y: 1..4 });
        assert_eq!(changes.cut(&after, 5).collect::<Vec<_>>(), [0, 1, 0, 0, 0, 3, 2, 0, 0]);
    }
}
