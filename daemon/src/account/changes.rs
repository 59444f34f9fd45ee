//! How inputs, belief and buses were at the last tick: a change is told, and only then.

use coloc_drivers::encoder::Slip;
use coloc_estimator::{Belief, GyroState, Stamp};
use coloc_shm_types::{BusState, Health, Input, Opinion, Status};

use super::losses::Teller;
use crate::event::{Event, GyroNews};
use crate::health::Standing;

/// At the last tick.
#[derive(Debug, Default)]
pub(super) struct Changes {
    health: [Health; Input::COUNT],
    opinion: Opinion,
    standing: Standing,
    bus: BusState,
    slips: Option<&'static str>,
    gyro: Gyro,
}

/// What is known and was told of the gyro.
#[derive(Debug, Default)]
struct Gyro {
    slipping_since: Option<Stamp>,
    is_known: bool,
    bias_radps: f64,
    sigma_radps: f64,
    /// So many wild samples were told of.
    wild: u32,
}

/// A bias that is known better than this is told, and one that is known worse than twice this is not known \[rad/s\].
const KNOWN: f64 = 2e-3;

impl Changes {
    /// At `tick`.
    pub(super) fn health(
        &mut self,
        health: [Health; Input::COUNT],
        tick: u64,
        teller: &mut Teller,
    ) {
        if self.health == health {
            return;
        }
        let before = std::mem::replace(&mut self.health, health);
        for (input, (from, to)) in Input::ALL.into_iter().zip(before.into_iter().zip(health)) {
            if from != to {
                teller.tell(Event::Health {
                    input,
                    from,
                    to,
                    tick,
                });
            }
        }
    }

    /// At `tick`.
    pub(super) fn standing(
        &mut self,
        standing: Standing,
        belief: &Belief,
        tick: u64,
        teller: &mut Teller,
    ) {
        let before = std::mem::replace(&mut self.standing, standing);
        let (from, to) = (before.state, standing.state);
        if from != to {
            teller.tell(Event::State {
                from,
                to,
                waits_for_wheels: standing.waits_for_wheels,
                tick,
            });
        }
        if before.unfit != standing.unfit {
            let why_unfit = standing.why_unfit(belief);
            teller.tell(Event::Fitness { why_unfit, tick });
        }
    }

    pub(super) fn opinion(&mut self, opinion: Opinion, tick: u64, teller: &mut Teller) {
        let from = std::mem::replace(&mut self.opinion, opinion);
        if from != opinion {
            teller.tell(Event::Opinion {
                from,
                to: opinion,
                tick,
            });
        }
    }

    /// What is known of the gyro after a step, at `now`. Of wild samples it is told once there are twice as many.
    pub(super) fn gyro(&mut self, state: Option<GyroState>, now: Stamp, teller: &mut Teller) {
        let Some(state) = state else {
            return;
        };
        let (bias, sigma) = (state.bias, state.bias_variance.sqrt());
        let mut tell = |news| teller.tell(Event::Gyro { news, bias, sigma });
        match (self.gyro.slipping_since, state.slipping_since) {
            (None, Some(_)) => tell(GyroNews::Slips),
            (Some(since), None) => tell(GyroNews::Holds {
                after_ns: (now - since).as_nanos(),
            }),
            _ => {}
        }
        if !self.gyro.is_known && sigma < KNOWN {
            tell(GyroNews::Known);
        }
        let mut wild = self.gyro.wild;
        if state.wild > 0 && state.wild >= wild.saturating_mul(2) {
            wild = state.wild;
            tell(GyroNews::Wild { count: wild });
        }
        self.gyro = Gyro {
            wild,
            slipping_since: state.slipping_since,
            bias_radps: bias,
            sigma_radps: sigma,
            is_known: sigma
                < if self.gyro.is_known {
                    2.0 * KNOWN
                } else {
                    KNOWN
                },
        };
    }

    /// Wheels that slip say what is wrong. (They do not make the robot lost: the gyro turns it.)
    #[allow(clippy::indexing_slicing)] // One place for each of the inputs' numbers.
    pub(super) fn parted(&self, health: &mut [Health; Input::COUNT]) {
        let odometry = &mut health[Input::Odometry as usize];
        if self.gyro.slipping_since.is_some() && *odometry == Health::Ok {
            *odometry = Health::Faulty;
        }
    }

    pub(super) fn buses(&mut self, worst: BusState, teller: &mut Teller) {
        let from = std::mem::replace(&mut self.bus, worst);
        if from != worst {
            teller.tell(Event::Bus { from, to: worst });
        }
    }

    /// Another wheel is another slip.
    pub(super) fn slip(&mut self, slip: Option<Slip>, teller: &mut Teller) {
        let wheel = slip.map(|slip| slip.wheel);
        if std::mem::replace(&mut self.slips, wheel) != wheel {
            teller.tell(Event::Slips(slip));
        }
    }

    pub(super) fn write_to(&self, status: &mut Status) {
        for (byte, health) in status.health.iter_mut().zip(self.health) {
            *byte = health as u8;
        }
        status.state = self.standing.state as u8;
        (status.fit, status.unfit, status.fit_limit) = self.standing.fitness();
        status.bus = self.bus as u8;
        status.gyro_bias_radps = self.gyro.bias_radps;
        status.gyro_bias_sigma_radps = self.gyro.sigma_radps;
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use coloc_shm_types::{BeliefState, Unfit};

    use super::*;
    use crate::event::Link;

    #[test]
    fn wild_samples_are_told_of_when_there_are_twice_as_many() {
        let link = Arc::new(Link::new());
        let mut teller = Teller::new(Arc::clone(&link));
        let mut changes = Changes::default();
        let told = [0, 1, 1, 2, 3, 5, 6, 9, 10].map(|wild| {
            let before = link.waiting();
            let state = GyroState {
                bias: 0.0,
                bias_variance: 1.0,
                slipping_since: None,
                wild,
            };
            changes.gyro(Some(state), Stamp::default(), &mut teller);
            link.waiting() - before
        });
        assert_eq!(told, [0, 1, 0, 1, 0, 1, 0, 0, 1]);
    }

    #[test]
    fn what_changes_is_told_once() {
        let link = Arc::new(Link::new());
        let mut teller = Teller::new(Arc::clone(&link));
        let mut changes = Changes::default();
        let mut health = [Health::NeverSeen; Input::COUNT];
        let mut tell = |health, state, bus| {
            let before = link.waiting();
            let standing = Standing {
                state,
                unfit: Some((Unfit::Heading, 0.25)),
                waits_for_wheels: false,
            };
            changes.health(health, 7, &mut teller);
            changes.standing(standing, &Belief::default(), 7, &mut teller);
            changes.buses(bus, &mut teller);
            link.waiting() - before
        };
        let (finding, active) = (BeliefState::default(), BusState::Active);
        assert_eq!(tell(health, finding, active), 1, "why it is not fit");
        assert_eq!(tell(health, finding, active), 0);
        health[Input::Position as usize] = Health::Ok;
        assert_eq!(tell(health, finding, active), 1);
        assert_eq!(tell(health, BeliefState::Ok, BusState::Off), 2);
        assert_eq!(tell(health, BeliefState::Ok, BusState::Off), 0);
        let mut status = Status::default();
        changes.write_to(&mut status);
        assert_eq!(status.health_of(Input::Position), Health::Ok);
        assert_eq!(status.health_of(Input::Neighbour), Health::NeverSeen);
        assert_eq!(
            (status.state(), status.bus_state()),
            (BeliefState::Ok, BusState::Off)
        );
        let heading = (Some(Unfit::Heading), 0.25_f32.to_bits());
        assert_eq!((status.unfit(), status.fit_limit.to_bits()), heading);
    }
}
