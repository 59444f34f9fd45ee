//! A leader, and a child by one of the methods.

use coloc_estimator::assist::bond::{Bonds, News};
use coloc_estimator::assist::cross;
use coloc_estimator::assist::events::Word;
use coloc_estimator::assist::fusion::Rule;
use coloc_estimator::assist::slot::Slot;
use coloc_estimator::assist::transition::{Transitions, driven, fixed, turned};
use coloc_estimator::heading::{self, HeadingNoise};
use coloc_estimator::{Belief, Covariance2, GlobalPose, Motion, Propagation, fix, propagate};

/// χ² with one, two and three degrees of freedom, 99.9 %.
const GATES: [f64; 3] = [
    10.827_566_170_662_733,
    13.815_510_557_964_274,
    16.266_236_196_238_13,
];

pub(super) const PAPER: Propagation = Propagation::Paper;

/// What a child does with a pose.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) enum Method {
    /// Takes it as news.
    Kalman,
    /// Takes the leader's error as dependent.
    Split,
    /// Tracks its correlation with the leader's error, of which it hears at every event.
    Cross,
    /// Tracks it by what data say.
    Default,
}

impl Method {
    pub(crate) const ALL: [Self; 4] = [Self::Kalman, Self::Split, Self::Cross, Self::Default];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Kalman => "leader-kf",
            Self::Split => "leader-split",
            Self::Cross => "leader-cross",
            Self::Default => "leader-default",
        }
    }
}

/// F of a step of the odometry.
fn step(belief: &Belief, motion: &Motion, dt_s: f64) -> nalgebra::Matrix3<f64> {
    let [v, _, _] = motion.velocity();
    driven(belief.pose.phi, [dt_s * v, 0.0])
}

/// What became of a pose.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Heard {
    pub(crate) accepted: bool,
    pub(crate) d2: f64,
}

/// A child by one method.
#[derive(Clone, Debug)]
pub(crate) struct Child {
    method: Method,
    pub(crate) belief: Belief,
    bonds: Bonds,
}

impl Child {
    pub(crate) fn new(method: Method, belief: Belief) -> Self {
        Self {
            method,
            belief,
            bonds: Bonds::default(),
        }
    }

    pub(crate) fn drive(&mut self, motion: &Motion, dt_s: f64) {
        self.bonds.go_on(&step(&self.belief, motion, dt_s));
        self.belief = propagate(&self.belief, motion, dt_s, PAPER);
    }

    /// What the leader at `place` says of itself at an event, and of this child, if it does; then what became of that.
    pub(crate) fn hear(
        &mut self,
        place: usize,
        news: &News,
        said: Option<&GlobalPose>,
    ) -> Option<Heard> {
        let gate = GATES[2];
        let Some(said) = said else {
            if self.method == Method::Cross {
                self.bonds.hear(place, news);
            }
            return None;
        };
        let rule = match self.method {
            Method::Kalman => Rule::paper(),
            Method::Split => Rule::default(),
            Method::Cross | Method::Default => {
                let doubted = news.doubted();
                let news = if self.method == Method::Default {
                    &doubted
                } else {
                    news
                };
                let update = self.bonds.fuse(&self.belief, place, (news, said), gate);
                self.belief = update.belief;
                let (accepted, d2) = (update.accepted, update.d2);
                return Some(Heard { accepted, d2 });
            }
        };
        let fusion = rule.fuse_one(&self.belief, said);
        self.belief = fusion.belief;
        let (accepted, d2) = (fusion.accepted, fusion.d2);
        Some(Heard { accepted, d2 })
    }

    /// After all poses of an event with some.
    pub(crate) fn end_event(&mut self) {
        if self.method == Method::Split {
            self.belief.make_dependent();
        }
    }
}

/// A leader.
#[derive(Clone, Debug)]
pub(crate) struct Leader {
    pub(crate) belief: Belief,
    transitions: Transitions,
}

/// Position and heading, each with its noise.
pub(crate) struct Absolute {
    pub(crate) position: [f64; 2],
    pub(crate) covariance: Covariance2,
    pub(crate) heading: f64,
    pub(crate) variance: f64,
}

impl Leader {
    pub(crate) fn new(belief: Belief) -> Self {
        Self {
            belief,
            transitions: Transitions::default(),
        }
    }

    pub(crate) fn drive(&mut self, motion: &Motion, dt_s: f64) {
        self.transitions.go_on(&step(&self.belief, motion, dt_s));
        self.belief = propagate(&self.belief, motion, dt_s, PAPER);
    }

    pub(crate) fn correct(&mut self, by: &Absolute) {
        self.fix(by.position, &by.covariance);
        let white = HeadingNoise::white(by.variance);
        let update = heading::update(&self.belief, by.heading, &white, GATES[0]);
        if update.accepted {
            self.transitions.go_on(&turned(&self.belief, by.variance));
        }
        self.belief = update.belief;
    }

    /// By its receiver alone.
    pub(crate) fn fix(&mut self, position: [f64; 2], covariance: &Covariance2) -> Heard {
        let update = fix::update(&self.belief, position, covariance, GATES[1]);
        if update.accepted {
            self.transitions.go_on(&fixed(&self.belief, covariance));
        }
        self.belief = update.belief;
        let (accepted, d2) = (update.accepted, update.d2);
        Heard { accepted, d2 }
    }

    pub(crate) fn at_event(&mut self, slot: Slot) -> News {
        let leader = cross::Leader {
            pose: self.belief.pose,
            covariance: self.belief.total(),
        };
        let past = self.transitions.at_event();
        let word = Word { leader, past };
        News { slot, word }
    }
}
