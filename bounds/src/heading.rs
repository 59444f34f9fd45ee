//! How well the headings of a team are known.

use core::f64::consts::PI;

use crate::interval::{AngleInterval, wrap};

/// Rounding of a direction that is computed of positions \[rad\].
const ROUNDING: f64 = 1e-9;

/// What one robot's heading says of another's.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Link {
    /// The one, from 0.
    pub from: usize,
    /// The other.
    pub to: usize,
    /// `θ_to − θ_from`
    pub turn: AngleInterval,
}

impl Link {
    /// Both robots see each other, each in its own frame: their lines of sight differ by π.
    #[must_use]
    pub fn mutual(i: usize, j: usize, i_sees: AngleInterval, j_sees: AngleInterval) -> Self {
        Self {
            from: i,
            to: j,
            turn: AngleInterval::new(
                wrap(i_sees.centre - j_sees.centre + PI),
                i_sees.half + j_sees.half,
            ),
        }
    }

    pub(crate) fn reversed(&self) -> Self {
        Self {
            from: self.to,
            to: self.from,
            turn: AngleInterval::new(-self.turn.centre, self.turn.half),
        }
    }
}

/// The narrowest heading interval of each of `robots` along any chain of links from a source; `None` where no chain leads.
///
/// Sources and links that name robots which are not there are left out.
#[must_use]
pub fn tree(
    robots: usize,
    sources: &[(usize, AngleInterval)],
    links: &[Link],
) -> Vec<Option<AngleInterval>> {
    let mut found: Vec<Option<AngleInterval>> = vec![None; robots];
    for &(robot, heading) in sources.iter().filter(|it| it.0 < robots) {
        keep_narrower(&mut found[robot], heading);
    }
    let mut settled = vec![false; robots];
    while let Some(next) = narrowest(&found, &settled) {
        settled[next] = true;
        let heading = found[next].unwrap_or(AngleInterval::UNKNOWN);
        for link in links
            .iter()
            .filter(|it| it.from < robots && it.to < robots)
            .flat_map(|it| [*it, it.reversed()])
            .filter(|it| it.from == next)
        {
            let there = AngleInterval::new(
                wrap(heading.centre + link.turn.centre),
                heading.half + link.turn.half,
            );
            keep_narrower(&mut found[link.to], there);
        }
    }
    found
}

fn keep_narrower(kept: &mut Option<AngleInterval>, new: AngleInterval) {
    if kept.is_none_or(|it| new.half < it.half) {
        *kept = Some(new);
    }
}

fn narrowest(found: &[Option<AngleInterval>], settled: &[bool]) -> Option<usize> {
    let open = (0..found.len()).filter(|&i| !settled[i]);
    open.filter_map(|i| found[i].map(|it| (i, it.half)))
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map(|it| it.0)
}

/// The directions in which `x_j − x_i` can point, if it is in `vertices` and they lie on one side of a line through zero.
///
/// `away` is any direction with `away · vertex > 0` for all of them: `None` if there is a vertex where that is not so.
#[must_use]
pub fn direction(vertices: &[[f64; 2]], away: [f64; 2]) -> Option<AngleInterval> {
    let middle = libm::atan2(away[1], away[0]);
    let mut low = f64::INFINITY;
    let mut high = f64::NEG_INFINITY;
    for vertex in vertices {
        if away[0] * vertex[0] + away[1] * vertex[1] <= 0.0 {
            return None;
        }
        let turn = wrap(libm::atan2(vertex[1], vertex[0]) - middle);
        (low, high) = (low.min(turn), high.max(turn));
    }
    (low <= high).then(|| {
        AngleInterval::new(
            wrap(middle + f64::midpoint(low, high)),
            (high - low) / 2.0 + ROUNDING,
        )
    })
}

/// The body-frame directions of a box: where a sighting says that the other robot is. Unknown if the box holds zero.
#[must_use]
pub fn bearing_of_box(centre: [f64; 2], half: [f64; 2]) -> AngleInterval {
    let corners = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)]
        .map(|(a, b)| [centre[0] + a * half[0], centre[1] + b * half[1]]);
    let sides = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];
    sides
        .into_iter()
        .find_map(|away| direction(&corners, away))
        .unwrap_or(AngleInterval::UNKNOWN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chain_adds_widths_and_goes_both_ways() {
        let a = AngleInterval::new;
        let links = [
            Link {
                from: 0,
                to: 1,
                turn: a(0.5, 0.1),
            },
            Link {
                from: 2,
                to: 1,
                turn: a(0.2, 0.05),
            },
            Link {
                from: 7,
                to: 1,
                turn: a(0.0, 0.0),
            },
        ];
        let found = tree(4, &[(0, a(0.0, 0.0)), (9, a(0.0, 0.0))], &links);
        assert_eq!(found[1], Some(a(0.5, 0.1)));
        let third = found[2].unwrap();
        assert!((third.centre - 0.3).abs() < 1e-15 && (third.half - 0.15).abs() < 1e-15);
        assert_eq!(found[3], None);
    }

    #[test]
    fn a_box_around_zero_points_nowhere() {
        assert!(bearing_of_box([0.1, 0.0], [0.2, 0.2]).is_unknown());
        let seen = bearing_of_box([-2.0, 0.0], [0.5, 0.5]);
        assert!(seen.contains(PI, 0.0) && seen.half < 0.4);
        assert!(seen.contains(libm::atan2(0.5, -1.5), 0.0));
    }
}
