//! One message, and waiting for what comes of it.

use std::thread::sleep;
use std::time::{Duration, Instant};

use coloc_shm_types::{
    Clock, Estimate, Pose, Publisher, RobotName, Sender, Space, Status as Counted, Subscriber,
};

use super::outcome::{Asked, Taken};
use super::{PoseArgs, PoseError};
use crate::demo::clock::now_ns;
use crate::demo::interrupt::Interrupt;
use crate::place::Place;

/// A daemon says an estimate at every tick and counts once a second.
const SPEAKS: Duration = Duration::from_secs(5);
/// The history is a second long by default, and then it is believed.
const BELIEVES: Duration = Duration::from_secs(8);
const PAUSE: Duration = Duration::from_millis(5);

/// The number of a person among those who say poses: there is one, and maps have others.
const PERSON: u16 = 0;

pub(super) struct Telling {
    robot: RobotName,
    pose: [f64; 3],
    sigma: [f64; 3],
    poses: Publisher<Pose>,
    estimates: Subscriber<Estimate>,
    counted: Subscriber<Counted>,
    sender: Sender,
    // Dropped last.
    _space: Space,
}

/// The last that was heard.
#[derive(Default)]
struct Heard {
    estimate: Option<Estimate>,
    /// When it was last where it was told.
    there: Option<Estimate>,
    counted: Option<Counted>,
    /// Estimates so far.
    estimates: u32,
}

impl Telling {
    pub(super) fn open(place: &Place, args: &PoseArgs) -> Result<Self, PoseError> {
        let space = Space::join(&place.root, &place.prefix, "coloc-pose")?;
        let robot = &args.robot;
        Ok(Self {
            poses: space.publisher(robot)?,
            estimates: space.subscriber(robot)?,
            counted: space.subscriber(robot)?,
            sender: Sender::start(PERSON, Clock::Boottime).map_err(PoseError::Random)?,
            robot: robot.clone(),
            pose: args.pose(),
            sigma: args.sigma(),
            _space: space,
        })
    }

    /// What came of it, in a sentence; `None` if it was interrupted.
    pub(super) fn tell(mut self, interrupt: &Interrupt) -> Result<Option<String>, PoseError> {
        let mut heard = Heard::default();
        let Some((before, counted)) = self.listen(&mut heard, interrupt)? else {
            return Ok(None);
        };
        let asked = Asked {
            stamp_ns: now_ns(),
            source: PERSON,
            pose: self.pose,
            sigma: self.sigma,
            before,
            counted,
        };
        self.send(asked.stamp_ns);
        self.wait(&asked, &mut heard, interrupt)
    }

    /// Until it has said where it is and what it has counted, and has had a tick in which to see that somebody speaks to it.
    fn listen(
        &self,
        heard: &mut Heard,
        interrupt: &Interrupt,
    ) -> Result<Option<(Estimate, Counted)>, PoseError> {
        let deadline = Instant::now() + SPEAKS;
        while !interrupt.is_there() {
            self.hear(heard, |_| false);
            if let (Some(estimate), Some(counted), true) =
                (heard.estimate, heard.counted, heard.estimates > 2)
            {
                return Ok(Some((estimate, counted)));
            }
            if Instant::now() > deadline {
                return Err(PoseError::Silent(self.robot.clone()));
            }
            sleep(PAUSE);
        }
        Ok(None)
    }

    fn send(&mut self, stamp_ns: i64) {
        let [x, y, heading] = self.sigma.map(|sigma| sigma * sigma);
        let message = Pose {
            header: self.sender.header(stamp_ns),
            set: Pose::SET,
            pose: self.pose,
            covariance: [x, 0.0, 0.0, 0.0, y, 0.0, 0.0, 0.0, heading],
            ..Pose::default()
        };
        // Whether it has arrived is seen by what the robot counts.
        let _ = self.poses.send(message);
    }

    fn wait(
        &self,
        asked: &Asked,
        heard: &mut Heard,
        interrupt: &Interrupt,
    ) -> Result<Option<String>, PoseError> {
        let deadline = Instant::now() + BELIEVES;
        while !interrupt.is_there() {
            self.hear(heard, |estimate| asked.is_there(estimate));
            let taken = heard.counted.and_then(|counted| asked.taken(&counted));
            if let Some(Taken::Refused(reason)) = taken {
                let robot = self.robot.clone();
                return Err(PoseError::Refused { robot, reason });
            }
            if let (Some(Taken::Valid), Some(there), Some(now)) =
                (taken, heard.there, heard.estimate)
            {
                return Ok(Some(asked.sentence(&self.robot, &there, &now)));
            }
            if Instant::now() > deadline {
                let robot = self.robot.clone();
                return Err(match taken {
                    Some(_) => PoseError::Elsewhere(robot),
                    None => PoseError::NotTaken(robot),
                });
            }
            sleep(PAUSE);
        }
        Ok(None)
    }

    /// What cannot be read is not heard.
    fn hear(&self, heard: &mut Heard, is_there: impl Fn(&Estimate) -> bool) {
        while let Ok(Some(estimate)) = self.estimates.receive() {
            heard.estimate = Some(estimate);
            if is_there(&estimate) {
                heard.there = Some(estimate);
            }
            heard.estimates = heard.estimates.saturating_add(1);
        }
        while let Ok(Some(counted)) = self.counted.receive() {
            heard.counted = Some(counted);
        }
    }
}
