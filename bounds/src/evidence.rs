//! What a robot knows of a slot of time by its own sensors, with hard bounds, and tells the others.
//!
//! Everything is of the slot's end: fixes and sightings are moved there by what the robot's wheels can have done since.

use crate::interval::AngleInterval;
use crate::measurement::{spaced, support_of_box};
use crate::team::{Motion, Supports};

/// In how many directions motion is supported.
pub const DIRECTIONS: usize = 16;

/// So many sightings a robot tells of a slot, the newest of each neighbour.
pub const MOST_SIGHTINGS: usize = 16;

/// A box by the axes of some frame.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Area {
    /// \[m\]
    pub centre: [f64; 2],
    /// \[m\]
    pub half: [f64; 2],
}

/// Where a neighbour is in the robot's own frame, and which way it looks there.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Seen {
    /// Its number in the team, from 0.
    pub observed: usize,
    /// In the robot's frame \[m\].
    pub area: Area,
    /// Its heading less the robot's.
    pub turn: AngleInterval,
}

/// What a robot tells of a slot.
#[derive(Clone, Debug, PartialEq)]
pub struct Evidence {
    /// How far it can have moved, in the common frame.
    pub moved: Supports,
    /// How it turned.
    pub turn: AngleInterval,
    /// What its compass says.
    pub compass: Option<AngleInterval>,
    /// Where its receiver says that it is.
    pub fix: Option<Area>,
    /// Each neighbour once.
    pub seen: Vec<Seen>,
}

/// How far off wheels can be, and how fast the robot can be without them.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Wheels {
    /// Forward \[m/s\].
    pub speed_mps: f64,
    /// To the side: never zero \[m/s\].
    pub sideways_mps: f64,
    /// \[rad/s\]
    pub turn_radps: f64,
    /// Of any robot of the team, in any direction \[m/s\].
    pub max_speed_mps: f64,
    /// Of any robot of the team \[rad/s\].
    pub max_turn_radps: f64,
}

impl Wheels {
    /// What they say for `seconds`.
    #[must_use]
    pub fn motion(&self, [speed, rate]: [f64; 2], seconds: f64) -> Motion {
        Motion {
            velocity: [speed, 0.0],
            velocity_half: [self.speed_mps, self.sideways_mps],
            rate,
            rate_half: self.turn_radps,
            seconds,
        }
    }

    /// When they say nothing.
    #[must_use]
    pub fn unknown(&self, seconds: f64) -> Motion {
        Motion {
            velocity: [0.0; 2],
            velocity_half: [self.max_speed_mps; 2],
            rate: 0.0,
            rate_half: self.max_turn_radps,
            seconds,
        }
    }
}

/// What happened since a moment, in a frame that does not turn.
#[derive(Clone, Debug)]
struct Since {
    /// Supports in four directions: a box.
    moved: Supports,
    /// Of the robot in that frame.
    heading: AngleInterval,
    /// \[s\]
    seconds: f64,
}

impl Since {
    fn begin(heading: AngleInterval) -> Self {
        Self {
            moved: Supports::zero(4),
            heading,
            seconds: 0.0,
        }
    }

    fn drive(&mut self, motion: &Motion) {
        let heading = drive(&mut self.moved, self.heading, motion);
        self.heading = heading;
        self.seconds += motion.seconds;
    }

    fn area(&self) -> Area {
        Area::of_supports([0, 1, 2, 3].map(|k| self.moved.values()[k]))
    }
}

/// Adds a motion, and answers the heading after it.
fn drive(moved: &mut Supports, heading: AngleInterval, motion: &Motion) -> AngleInterval {
    let Motion {
        rate,
        rate_half,
        seconds,
        ..
    } = *motion;
    moved.add_motion(motion, heading.during(rate, rate_half, seconds));
    heading.turned(rate, rate_half, seconds)
}

impl Area {
    /// What reaches so far to the right, up, left and down.
    fn of_supports([right, up, left, down]: [f64; 4]) -> Self {
        Self {
            centre: [(right - left) / 2.0, (up - down) / 2.0],
            half: [f64::midpoint(right, left), f64::midpoint(up, down)],
        }
    }

    /// Any point of this one and any of `other` added.
    fn plus(&self, other: &Self) -> Self {
        Self {
            centre: [0, 1].map(|it| self.centre[it] + other.centre[it]),
            half: [0, 1].map(|it| self.half[it] + other.half[it]),
        }
    }

    /// What both allow; `None` if that is nothing.
    fn intersect(&self, other: &Self) -> Option<Self> {
        let ends = |it: &Self, axis: usize, sign: f64| it.centre[axis] + sign * it.half[axis];
        let least = [0, 1].map(|axis| ends(self, axis, -1.0).max(ends(other, axis, -1.0)));
        let most = [0, 1].map(|axis| ends(self, axis, 1.0).min(ends(other, axis, 1.0)));
        (least[0] <= most[0] && least[1] <= most[1]).then(|| Self {
            centre: [0, 1].map(|axis| f64::midpoint(least[axis], most[axis])),
            half: [0, 1].map(|axis| (most[axis] - least[axis]) / 2.0),
        })
    }

    fn reversed(&self) -> Self {
        Self {
            centre: self.centre.map(|it| -it),
            half: self.half,
        }
    }

    fn wider(&self, by: f64) -> Self {
        Self {
            centre: self.centre,
            half: self.half.map(|it| it + by),
        }
    }

    /// Around it, turned by any angle of `angle`.
    #[must_use]
    pub fn turned(&self, angle: AngleInterval) -> Self {
        let support = |k| support_of_box(spaced(k, 4), self.centre, self.half, angle);
        Self::of_supports([0, 1, 2, 3].map(support))
    }
}

/// The slot that is going on: everything is said to it in the order in which it was.
#[derive(Clone, Debug)]
pub struct Gather {
    wheels: Wheels,
    moved: Supports,
    turn: AngleInterval,
    /// Now, as far as it is known.
    heading: AngleInterval,
    compass: Option<AngleInterval>,
    fix: Option<(Area, Since)>,
    judged: Option<([f64; 2], Since)>,
    seen: Vec<(Seen, Since)>,
}

impl Gather {
    /// A slot begins, and the robot's heading is in `heading`.
    #[must_use]
    pub fn begin(wheels: Wheels, heading: AngleInterval) -> Self {
        Self {
            wheels,
            moved: Supports::zero(DIRECTIONS),
            turn: AngleInterval::new(0.0, 0.0),
            heading,
            compass: None,
            fix: None,
            judged: None,
            seen: Vec::new(),
        }
    }

    /// The robot moved.
    pub fn drive(&mut self, motion: &Motion) {
        let Motion {
            rate,
            rate_half,
            seconds,
            ..
        } = *motion;
        self.heading = drive(&mut self.moved, self.heading, motion);
        self.turn = self.turn.turned(rate, rate_half, seconds);
        self.compass = self.compass.map(|it| it.turned(rate, rate_half, seconds));
        let fix = self.fix.iter_mut().map(|it| &mut it.1);
        let judged = self.judged.iter_mut().map(|it| &mut it.1);
        let seen = self.seen.iter_mut().map(|it| &mut it.1);
        fix.chain(judged)
            .chain(seen)
            .for_each(|it| it.drive(motion));
    }

    /// The compass says this now. What it narrows here is how the robot moves; who lies if it does not fit is decided at the slot's end.
    pub fn turn_to(&mut self, compass: AngleInterval) {
        self.compass = Some(match self.compass {
            Some(before) => before.intersect(&compass).unwrap_or(compass),
            None => compass,
        });
        let both = self.heading.intersect(&compass);
        self.heading = both.unwrap_or(AngleInterval::UNKNOWN);
    }

    /// The receiver says this now. Where it cannot have been by an earlier fix of the slot, the newer one counts alone.
    pub fn fix(&mut self, area: Area) {
        let before = self
            .fix
            .take()
            .map(|(area, since)| area.plus(&since.area()));
        let both = before.and_then(|it| it.intersect(&area));
        self.fix = Some((both.unwrap_or(area), Since::begin(self.heading)));
    }

    /// A neighbour is seen now. The newest sighting of each is kept.
    pub fn see(&mut self, seen: Seen) {
        self.seen.retain(|it| it.0.observed != seen.observed);
        if self.seen.len() == MOST_SIGHTINGS {
            self.seen.remove(0);
        }
        let ahead = Since::begin(AngleInterval::new(0.0, 0.0));
        self.seen.push((seen, ahead));
    }

    /// The same of a receiver whose antenna is at `lever` in the robot's frame \[m\].
    pub fn fix_of_antenna(&mut self, area: Area, lever: [f64; 2]) {
        let arm = Area {
            centre: lever,
            half: [0.0; 2],
        };
        self.fix(area.plus(&arm.turned(self.heading).reversed()));
    }

    /// Something that is no evidence, but is to be judged, has the robot here now.
    pub fn estimate(&mut self, position: [f64; 2]) {
        self.judged = Some((position, Since::begin(self.heading)));
    }

    /// The slot ends. The evidence, and where what is to be judged has the robot now, as far as that is known.
    #[must_use]
    pub fn end(self) -> (Evidence, Option<Area>) {
        let Wheels {
            max_speed_mps,
            max_turn_radps,
            ..
        } = self.wheels;
        let fix = self.fix.map(|(area, since)| area.plus(&since.area()));
        let seen = self.seen.iter().map(|(seen, since)| {
            let turned = since.heading;
            // How the neighbour moved since is not known here.
            let area = seen.area.plus(&since.area().reversed());
            let area = area.wider(max_speed_mps * since.seconds);
            let turn = seen.turn.minus(&turned);
            Seen {
                observed: seen.observed,
                area: if since.seconds > 0.0 {
                    area.turned(AngleInterval::new(-turned.centre, turned.half))
                } else {
                    seen.area
                },
                turn: turn.plus(&AngleInterval::new(0.0, max_turn_radps * since.seconds)),
            }
        });
        let evidence = Evidence {
            seen: seen.collect(),
            moved: self.moved,
            turn: self.turn,
            compass: self.compass,
            fix,
        };
        let judged = self.judged.map(|(centre, since)| {
            let half = [0.0; 2];
            Area { centre, half }.plus(&since.area())
        });
        (evidence, judged)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHEELS: Wheels = Wheels {
        speed_mps: 0.05,
        sideways_mps: 0.02,
        turn_radps: 0.1,
        max_speed_mps: 1.0,
        max_turn_radps: 2.0,
    };

    /// Where the truth of a drive ends that begins at the origin, each second by velocity and rate, in small steps.
    fn driven(drive: &[[f64; 3]]) -> [f64; 3] {
        let [mut x, mut y, mut phi] = [0.0_f64, 0.0, 0.3];
        for [forward, side, rate] in drive {
            for _ in 0..1000 {
                let (sin, cos) = phi.sin_cos();
                x += 1e-3 * (cos * forward - sin * side);
                y += 1e-3 * (sin * forward + cos * side);
                phi += 1e-3 * rate;
            }
        }
        [x, y, phi]
    }

    fn inside(area: &Area, [x, y]: [f64; 2]) -> bool {
        (x - area.centre[0]).abs() <= area.half[0] + 1e-3
            && (y - area.centre[1]).abs() <= area.half[1] + 1e-3
    }

    #[test]
    fn what_was_measured_before_the_end_holds_the_truth_at_the_end() {
        // What the wheels say, and by how much it is off, up to the bounds.
        let said = [[0.5, 0.4], [0.8, -0.6], [0.0, 0.9]];
        for [a, b, c] in [
            [1.0, 1.0, 1.0],
            [-1.0, 1.0, -1.0],
            [1.0, -1.0, 0.5],
            [0.0; 3],
        ] {
            let true_drive = said.map(|[v, w]| [v + 0.05 * a, 0.02 * b, w + 0.1 * c]);
            let [x, y, phi] = driven(&true_drive);
            let mut gather = Gather::begin(WHEELS, AngleInterval::new(0.25, 0.06));
            let other = [2.0, 1.0];
            let (sin, cos) = 0.3_f64.sin_cos();
            gather.fix(Area {
                centre: [0.1, -0.1],
                half: [0.1, 0.1],
            });
            gather.estimate([0.0, 0.0]);
            gather.see(Seen {
                observed: 1,
                area: Area {
                    centre: [
                        cos * other[0] + sin * other[1],
                        cos * other[1] - sin * other[0],
                    ],
                    half: [0.01; 2],
                },
                turn: AngleInterval::new(-0.3, 0.01),
            });
            for it in said {
                gather.drive(&WHEELS.motion(it, 1.0));
            }
            let (evidence, judged) = gather.end();
            assert!(inside(&evidence.fix.unwrap(), [x, y]));
            assert!(inside(&judged.unwrap(), [x, y]));
            assert!(evidence.turn.contains(phi - 0.3, 1e-3));
            let [dx, dy] = [other[0] - x, other[1] - y];
            let (sin, cos) = phi.sin_cos();
            let seen = evidence.seen[0];
            assert!(inside(
                &seen.area,
                [cos * dx + sin * dy, cos * dy - sin * dx]
            ));
            assert!(seen.turn.contains(-phi, 1e-3));
            for (k, support) in evidence.moved.values().iter().enumerate() {
                let psi = spaced(k, DIRECTIONS);
                assert!(psi.cos() * x + psi.sin() * y <= support + 1e-3, "{k}");
            }
        }
    }

    #[test]
    fn the_newest_sighting_of_each_neighbour_counts_and_there_is_an_end_of_them() {
        let mut gather = Gather::begin(WHEELS, AngleInterval::UNKNOWN);
        let seen = |observed, x| Seen {
            observed,
            area: Area {
                centre: [x, 0.0],
                half: [0.1; 2],
            },
            turn: AngleInterval::UNKNOWN,
        };
        for observed in 0..20 {
            gather.see(seen(observed, 1.0));
        }
        gather.see(seen(19, 2.0));
        let (evidence, _) = gather.end();
        assert_eq!(evidence.seen.len(), MOST_SIGHTINGS);
        assert_eq!(evidence.seen.last(), Some(&seen(19, 2.0)));
    }

    #[test]
    fn a_compass_that_cannot_be_leaves_the_heading_open() {
        let mut gather = Gather::begin(WHEELS, AngleInterval::new(0.0, 0.1));
        gather.turn_to(AngleInterval::new(2.0, 0.1));
        gather.drive(&WHEELS.motion([1.0, 0.0], 1.0));
        let (evidence, _) = gather.end();
        assert!(evidence.moved.values().iter().all(|it| *it > 0.9));
        assert!((evidence.compass.unwrap().half - 0.2).abs() < 1e-12);
    }
}
