//! Who is near, without asking everybody.

use coloc_estimator::Pose;

use super::RANGE_M;
use super::field::Field;

/// The robots by the cell that they are in. A cell is at least as wide as the range: who is in range is in the same cell or in
/// one beside it. Robots beyond the edge are in the cells at the edge.
#[derive(Clone, Debug)]
pub(super) struct Cells {
    /// Half of the field \[m\].
    half_m: f64,
    /// Cells.
    per_m: f64,
    /// Cells along a side.
    across: usize,
    /// Where each cell's members begin, row by row, and where the last one's end.
    begins: Vec<u32>,
    members: Vec<Member>,
}

/// A robot where it is.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub(super) struct Member {
    pub(super) number: u32,
    pub(super) place: Pose,
}

/// A robot in range.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct Near {
    pub(super) member: Member,
    /// \[m²\]
    pub(super) square_m2: f64,
}

impl Cells {
    /// Empty ones.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_precision_loss,
        clippy::cast_sign_loss
    )] // At most some hundred.
    pub(super) fn new(field: Field) -> Self {
        let across = ((field.side_m / RANGE_M) as usize).max(1);
        Self {
            half_m: field.side_m / 2.0,
            per_m: across as f64 / field.side_m,
            across,
            begins: vec![0; across * across + 1],
            members: Vec::new(),
        }
    }

    /// Sorts the robots into their cells, in each by their numbers: two passes over them.
    pub(super) fn fill(&mut self, places: &[Pose]) {
        self.begins.fill(0);
        for place in places {
            let cell = self.cell(place);
            self.begins[cell] += 1;
        }
        // Each begins where it will end, and is filled from its end.
        let mut ends = 0;
        for begin in &mut self.begins {
            ends += *begin;
            *begin = ends;
        }
        self.members.resize(places.len(), Member::default());
        for (number, &place) in places.iter().enumerate().rev() {
            #[allow(clippy::cast_possible_truncation)] // Below 2^16.
            let number = number as u32;
            let cell = self.cell(&place);
            self.begins[cell] -= 1;
            self.members[self.begins[cell] as usize] = Member { number, place };
        }
    }

    /// Everybody in range of `place` but `number`, who is there; no others.
    pub(super) fn near(&self, number: usize, place: Pose) -> impl Iterator<Item = Near> {
        let [column, row] = [place.x, place.y].map(|along_m| self.along(along_m));
        let beside = |at: usize| at.saturating_sub(1)..=(at + 1).min(self.across - 1);
        let columns = beside(column);
        let rows = beside(row).map(move |row| row * self.across);
        let candidates =
            rows.flat_map(move |row| self.between(row + columns.start(), row + columns.end()));
        candidates.filter_map(move |&member| {
            let [dx, dy] = [member.place.x - place.x, member.place.y - place.y];
            let square_m2 = dx * dx + dy * dy;
            let is_near = square_m2 <= RANGE_M * RANGE_M && member.number as usize != number;
            is_near.then_some(Near { member, square_m2 })
        })
    }

    /// The members of cells that follow one another.
    fn between(&self, first: usize, last: usize) -> &[Member] {
        let [begin, end] = [first, last + 1].map(|cell| self.begins[cell] as usize);
        &self.members[begin..end]
    }

    fn cell(&self, place: &Pose) -> usize {
        self.along(place.y) * self.across + self.along(place.x)
    }

    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // Saturates, which is what is wanted.
    fn along(&self, along_m: f64) -> usize {
        let at = (along_m + self.half_m) * self.per_m;
        (at as usize).min(self.across - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Noise, Purpose};

    fn by_asking_everybody(number: usize, places: &[Pose]) -> Vec<u32> {
        let in_range = |other: &usize| {
            let [dx, dy] = [
                places[*other].x - places[number].x,
                places[*other].y - places[number].y,
            ];
            *other != number && dx * dx + dy * dy <= RANGE_M * RANGE_M
        };
        let near = (0..places.len()).filter(in_range);
        near.map(|other| u32::try_from(other).unwrap()).collect()
    }

    #[test]
    fn cells_find_whom_asking_everybody_finds() {
        for (robots, seed) in [(1, 1), (2, 2), (10, 3), (57, 4), (600, 5)] {
            let field = Field::of(robots, crate::scale::NEIGHBOURS);
            let mut draws = Noise::new(seed, 0).draws(Purpose::Start, 0, 0, 0);
            // Some are beyond the edge.
            let reach = 0.53 * field.side_m;
            let mut along = || draws.uniform(-reach, reach);
            let places: Vec<Pose> = (0..robots)
                .map(|_| Pose::new(along(), along(), 0.0))
                .collect();
            let mut cells = Cells::new(field);
            cells.fill(&places[..robots / 2]);
            cells.fill(&places);
            for (number, &place) in places.iter().enumerate() {
                let near = cells.near(number, place);
                let mut found: Vec<u32> = near.map(|near| near.member.number).collect();
                found.sort_unstable();
                assert_eq!(found, by_asking_everybody(number, &places));
            }
        }
    }

    #[test]
    fn a_robot_has_the_place_that_it_was_given() {
        let places = [[0.0, 0.0], [3.0, 4.0]].map(|[x, y]| Pose::new(x, y, 1.0));
        let mut cells = Cells::new(Field::of(100, crate::scale::NEIGHBOURS));
        cells.fill(&places);
        let near: Vec<Near> = cells.near(0, places[0]).collect();
        let member = Member {
            number: 1,
            place: places[1],
        };
        let square_m2 = 25.0;
        assert_eq!(near, [Near { member, square_m2 }]);
    }
}
