//! Regions that go on from epoch to epoch while robots move.
//!
//! What is kept is how far each robot's region goes in some fixed directions, and the same of each pair. Motion adds how far a robot can have moved in
//! each direction. Then these half-planes and the new measurements are one polytope, and its shadows are what is kept. Every true
//! position satisfies every row at every step, whatever came late or not at all: less is said then, nothing wrong.

use crate::heading::{Link, bearing_of_box, direction};
use crate::interval::AngleInterval;
use crate::measurement::{
    HalfPlane, Measurement, Place, Refused, Seen, spaced, support_of_box, unit,
};
use crate::polygon::of_supports;
use crate::polytope::{Arena, BadFrame, Gauge, Polytope, Projection, Region, Source};

/// How a robot moved for a while, in its own frame.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Motion {
    /// Forward and to the left \[m/s\].
    pub velocity: [f64; 2],
    /// How far off \[m/s\]. Wheels slip: never zero to the side.
    pub velocity_half: [f64; 2],
    /// \[rad/s\]
    pub rate: f64,
    /// How far off \[rad/s\].
    pub rate_half: f64,
    /// \[s\]
    pub seconds: f64,
}

/// How far a set goes in equally spaced directions, from x on \[m\]. Infinity: nobody knows.
#[derive(Clone, Debug, PartialEq)]
pub struct Supports(Vec<f64>);

impl Supports {
    /// In as many directions as there are values; an even number.
    #[must_use]
    pub fn new(values: Vec<f64>) -> Self {
        Self(values)
    }

    /// Zero alone.
    #[must_use]
    pub fn zero(directions: usize) -> Self {
        Self(vec![0.0; directions])
    }

    /// Anywhere.
    #[must_use]
    pub fn unknown(directions: usize) -> Self {
        Self(vec![f64::INFINITY; directions])
    }

    /// Within `radius` of zero.
    #[must_use]
    pub fn disc(directions: usize, radius: f64) -> Self {
        Self(vec![radius; directions])
    }

    /// In each direction.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.0
    }

    /// The sum of a point of this set and one of `other`.
    pub fn add(&mut self, other: &Self) {
        for (value, more) in self.0.iter_mut().zip(&other.0) {
            *value += more;
        }
    }

    /// The difference of a point of this set and one of `other`.
    pub fn subtract(&mut self, other: &Self) {
        let count = other.0.len();
        for (k, value) in self.0.iter_mut().enumerate() {
            *value += other.0[(k + count / 2) % count];
        }
    }

    /// The way of one motion, at any heading of `heading`.
    pub fn add_motion(&mut self, motion: &Motion, heading: AngleInterval) {
        let count = self.0.len();
        let [centre, half] =
            [motion.velocity, motion.velocity_half].map(|of| of.map(|it| it * motion.seconds));
        for (k, value) in self.0.iter_mut().enumerate() {
            *value += support_of_box(spaced(k, count), centre, half, heading);
        }
    }

    /// The directions in which a point of the set can lie, if zero is not in it.
    #[must_use]
    pub fn direction(&self) -> Option<AngleInterval> {
        let nearest = (0..self.0.len()).min_by(|&a, &b| self.0[a].total_cmp(&self.0[b]))?;
        if self.0[nearest] >= 0.0 || !self.0.iter().all(|it| it.is_finite()) {
            return None;
        }
        let away = unit(spaced(nearest, self.0.len())).map(|it| -it);
        direction(&of_supports(&self.0), away)
    }

    /// The half-planes that are known.
    fn half_planes(&self) -> impl Iterator<Item = HalfPlane> {
        let count = self.0.len();
        let known = self.0.iter().enumerate().filter(|it| it.1.is_finite());
        known.map(move |(k, &rhs)| HalfPlane {
            normal: unit(spaced(k, count)),
            rhs,
        })
    }
}

/// One robot seen from another: `x_i − x_j`.
#[derive(Clone, Debug, PartialEq)]
pub struct Pair {
    /// The one, from 0.
    pub i: usize,
    /// The other.
    pub j: usize,
    /// Where the one is, seen from the other.
    pub region: Supports,
}

/// What a measurement by body axes says: headings are added when it is used.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Sighting {
    /// Who sees.
    pub observer: usize,
    /// Who is seen.
    pub observed: usize,
    /// Where, in the observer's frame \[m\].
    pub centre: [f64; 2],
    /// How far off \[m\].
    pub half: [f64; 2],
    /// In how many directions the box is supported, beside its own four.
    pub directions: usize,
}

/// What is known of a team.
#[derive(Clone, Debug, PartialEq)]
pub struct Team {
    /// Of each robot.
    pub headings: Vec<AngleInterval>,
    /// Of each robot: where it is, or where it is seen from the robot of the gauge.
    pub regions: Vec<Supports>,
    /// Of those pairs that are kept.
    pub pairs: Vec<Pair>,
    /// Everybody is seen from this robot, which moves too; else from the origin.
    pub gauge_robot: Option<usize>,
    directions: usize,
}

impl Team {
    /// Of `robots` of which nothing is known, without pairs. An even number of directions, at least four.
    #[must_use]
    pub fn new(robots: usize, directions: usize) -> Self {
        Self {
            headings: vec![AngleInterval::UNKNOWN; robots],
            regions: vec![Supports::unknown(directions); robots],
            pairs: Vec::new(),
            gauge_robot: None,
            directions,
        }
    }

    /// Turns a heading on by what a compass says.
    ///
    /// # Errors
    /// If the two exclude each other; then nothing changes.
    pub fn compass(&mut self, robot: usize, heading: AngleInterval) -> Result<(), Refused> {
        if robot >= self.headings.len() {
            return Err(Refused::UnknownRobot);
        }
        if !heading.is_valid() {
            return Err(Refused::NotFinite);
        }
        let both = self.headings[robot].intersect(&heading);
        self.headings[robot] = both.ok_or(Refused::Excluded)?;
        Ok(())
    }

    /// Regions and pairs after `moved`, how far each robot can have moved. Headings are turned by who knows the rates.
    pub fn predict(&mut self, moved: &[Supports]) {
        let gauge = self.gauge_robot;
        for (robot, region) in self.regions.iter_mut().enumerate() {
            if gauge == Some(robot) {
                *region = Supports::zero(self.directions);
                continue;
            }
            region.add(&moved[robot]);
            if let Some(gauge) = gauge {
                region.subtract(&moved[gauge]);
            }
        }
        for pair in &mut self.pairs {
            pair.region.add(&moved[pair.i]);
            pair.region.subtract(&moved[pair.j]);
        }
    }

    /// Headings by each other, along all links in both directions, for as long as that makes any narrower.
    ///
    /// # Errors
    /// The links that exclude what is known, or name robots that are not there; those change nothing.
    pub fn headings_from_links(&mut self, links: &[Link]) -> Result<(), Vec<usize>> {
        let mut excluded = Vec::new();
        for _ in 0..self.headings.len() {
            for (index, link) in links.iter().enumerate() {
                for link in [*link, link.reversed()] {
                    if self.follow(&link).is_none() {
                        excluded.push(index);
                    }
                }
            }
        }
        told(excluded)
    }

    fn follow(&mut self, link: &Link) -> Option<()> {
        let there = self.headings.get(link.from)?.plus(&link.turn);
        let kept = self.headings.get_mut(link.to)?;
        *kept = kept.intersect(&there)?;
        Some(())
    }

    /// Headings by where a sighting's robot is and where it is seen: two sweeps over all.
    ///
    /// # Errors
    /// The sightings that exclude what is known of a heading; those change nothing.
    pub fn headings_from_positions(&mut self, sightings: &[Sighting]) -> Result<(), Vec<usize>> {
        let mut excluded = Vec::new();
        for _ in 0..2 {
            for (index, sighting) in sightings.iter().enumerate() {
                let Some(line) = self.line(sighting.observed, sighting.observer) else {
                    continue;
                };
                let bearing = bearing_of_box(sighting.centre, sighting.half);
                if bearing.is_unknown() {
                    continue;
                }
                let heading = line.minus(&bearing);
                match self.headings[sighting.observer].intersect(&heading) {
                    Some(both) => self.headings[sighting.observer] = both,
                    None => excluded.push(index),
                }
            }
        }
        told(excluded)
    }

    /// The direction of `x_i − x_j`.
    fn line(&self, i: usize, j: usize) -> Option<AngleInterval> {
        self.pairs.iter().find_map(|pair| {
            let along = pair.region.direction();
            if (pair.i, pair.j) == (i, j) {
                along
            } else if (pair.j, pair.i) == (i, j) {
                let turned = AngleInterval::new(core::f64::consts::PI, 0.0);
                along.map(|it| it.plus(&turned))
            } else {
                None
            }
        })
    }

    /// A sighting with what is known of the observer's heading.
    #[must_use]
    pub fn measurement(&self, sighting: &Sighting) -> Measurement {
        let heading = self.headings.get(sighting.observer);
        Measurement::Between {
            from: Place::Robot(sighting.observer),
            to: Place::Robot(sighting.observed),
            seen: Seen::Box {
                centre: sighting.centre,
                half: sighting.half,
                heading: heading.copied().unwrap_or(AngleInterval::UNKNOWN),
                directions: sighting.directions,
            },
        }
    }

    /// What is known, as a polytope that measurements can be added to.
    ///
    /// # Errors
    /// If arena or slack mean nothing, or the robot of the gauge is not there.
    pub fn polytope(&self, arena: Arena, slack_m: f64) -> Result<Polytope, BadFrame> {
        let gauge: Vec<Gauge> = self
            .gauge_robot
            .into_iter()
            .flat_map(|robot| {
                [0, 1].map(|axis| Gauge {
                    robot,
                    axis,
                    value: 0.0,
                })
            })
            .collect();
        let mut polytope = Polytope::new(self.regions.len(), &gauge, arena, slack_m)?;
        for (robot, region) in self.regions.iter().enumerate() {
            if self.gauge_robot == Some(robot) {
                continue;
            }
            for half_plane in region.half_planes() {
                polytope.bound(Projection::Robot(robot), half_plane, Source::Motion(robot));
            }
        }
        for Pair { i, j, region } in &self.pairs {
            for half_plane in region.half_planes() {
                let source = Source::Pair(*i, *j);
                polytope.bound(Projection::Difference(*i, *j), half_plane, source);
            }
        }
        Ok(polytope)
    }

    /// Keeps the shadows of `region`, a polytope of this team with its new measurements. A shadow whose program fails stays as it is:
    /// it was true before.
    pub fn keep(&mut self, region: &mut Region) {
        for robot in (0..self.regions.len()).filter(|it| Some(*it) != self.gauge_robot) {
            keep_narrower(&mut self.regions[robot], region, Projection::Robot(robot));
        }
        for Pair { i, j, region: kept } in &mut self.pairs {
            keep_narrower(kept, region, Projection::Difference(*i, *j));
        }
    }
}

/// Each once.
fn told(mut excluded: Vec<usize>) -> Result<(), Vec<usize>> {
    excluded.sort_unstable();
    excluded.dedup();
    if excluded.is_empty() {
        Ok(())
    } else {
        Err(excluded)
    }
}

/// The old half-planes are rows of the polytope, so no shadow goes further; by rounding alone it seems to.
fn keep_narrower(kept: &mut Supports, region: &mut Region, projection: Projection) {
    if let Some(new) = region.template(projection, kept.0.len()) {
        for (old, new) in kept.0.iter_mut().zip(new) {
            *old = old.min(new);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DIRECTIONS: usize = 16;

    fn square_at(x: f64, y: f64) -> Supports {
        let mut region = Supports::zero(DIRECTIONS);
        region.add_motion(
            &Motion {
                velocity: [x, y],
                velocity_half: [0.5, 0.5],
                rate: 0.0,
                rate_half: 0.0,
                seconds: 1.0,
            },
            AngleInterval::new(0.0, 0.0),
        );
        region
    }

    #[test]
    fn a_pair_that_is_apart_says_a_heading() {
        let mut team = Team::new(2, DIRECTIONS);
        team.pairs.push(Pair {
            i: 1,
            j: 0,
            region: square_at(4.0, 0.0),
        });
        let seen = Sighting {
            observer: 0,
            observed: 1,
            centre: [0.0, -4.0],
            half: [0.1, 0.1],
            directions: 8,
        };
        assert_eq!(team.headings_from_positions(&[seen]), Ok(()));
        let heading = team.headings[0];
        assert!(
            heading.contains(core::f64::consts::FRAC_PI_2, 0.0),
            "{heading:?}"
        );
        assert!(heading.half < 0.2, "{heading:?}");
        let other = Sighting {
            centre: [0.0, 4.0],
            ..seen
        };
        assert_eq!(team.headings_from_positions(&[other]), Err(vec![0]));
        assert_eq!(team.headings[0], heading);
    }

    #[test]
    fn a_pair_that_may_be_at_one_place_says_none() {
        assert_eq!(square_at(0.2, 0.2).direction(), None);
        assert_eq!(Supports::unknown(DIRECTIONS).direction(), None);
    }

    #[test]
    fn links_hand_headings_on() {
        let mut team = Team::new(4, DIRECTIONS);
        team.headings[3] = AngleInterval::new(1.0, 0.1);
        let link = |from, to, turn| Link {
            from,
            to,
            turn: AngleInterval::new(turn, 0.02),
        };
        let links = [link(0, 1, 0.5), link(1, 2, 0.5), link(2, 3, 0.5)];
        assert_eq!(team.headings_from_links(&links), Ok(()));
        let first = team.headings[0];
        assert!((first.centre + 0.5).abs() < 1e-12 && (first.half - 0.16).abs() < 1e-12);
        let before = team.clone();
        let wrong = [link(0, 1, 2.0), link(0, 9, 0.0)];
        assert_eq!(team.headings_from_links(&wrong), Err(vec![0, 1]));
        assert_eq!(team, before);
    }

    #[test]
    fn who_is_not_heard_of_grows_alone() {
        let mut team = Team::new(2, DIRECTIONS);
        team.regions = vec![square_at(0.0, 0.0), square_at(4.0, 0.0)];
        let before = team.regions[0].clone();
        team.predict(&[Supports::zero(DIRECTIONS), Supports::disc(DIRECTIONS, 1.0)]);
        assert_eq!(team.regions[0], before);
        assert!((team.regions[1].values()[0] - 5.5).abs() < 1e-12);
        let arena = Arena {
            centre: [0.0; 2],
            half: 100.0,
        };
        let polytope = team.polytope(arena, 1e-9).unwrap();
        team.clone().keep(&mut polytope.region().unwrap());
    }
}
