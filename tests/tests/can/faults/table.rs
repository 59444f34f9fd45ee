//! Every way in which a bus or an encoder goes wrong, and what `colocd` makes of it.
//!
//! This table drives the tests, and `tests/hil/README.md` repeats it. A robot drives straight ahead at 0.5 m/s, 50 Hz;
//! then the fault begins.

use coloc_drivers::can::{ErrorClass, Frame, StandardId};
use coloc_drivers::encoder::LEFT_ID;
use coloc_shm_types::{BusState, Health};

use super::stage::{Pair, Stage};

pub(crate) struct Fault {
    pub(crate) name: &'static str,
    /// Lets it happen, once before each tick while it lasts. The pair is what the encoders have to say in this tick.
    pub(crate) happen: fn(&mut Stage, Pair),
    /// How many ticks it lasts.
    pub(crate) lasts: u32,
    /// What odometry's health becomes, and in which tick of the fault exactly; before that it is ok.
    pub(crate) health: Option<(Health, u32)>,
    /// The same of the bus; before that it is active.
    pub(crate) bus: Option<(BusState, u32)>,
    /// What the estimate may do while it lasts.
    pub(crate) estimate: Estimate,
    /// What ends it, if that is more than the encoders' frames coming again.
    pub(crate) end: fn(&mut Stage),
    /// In which tick after its end all is well at the latest: health ok, bus active, the pose exact.
    pub(crate) recovers: u32,
}

/// What the estimate may do.
pub(crate) enum Estimate {
    /// Nothing but follow the wheels, exactly.
    Exact,
    /// Predict: be wrong by so much \[m\]; exact again afterwards, because encoders count on.
    Predicts(f64),
    /// Believe the wheels: nothing in their frames tells that they are wrong.
    Believes,
}

use Estimate::{Believes, Exact, Predicts};

const fn nothing(_: &mut Stage) {}

/// What most faults have in common, and what happens where nothing does.
const HARMLESS: Fault = Fault {
    name: "",
    happen: |_, _| {},
    lasts: 50,
    health: None,
    bus: None,
    estimate: Exact,
    end: nothing,
    recovers: 1,
};

/// Half a second of standing where the robot drives, beyond what is held.
const DRIFT_M: f64 = 0.5;

pub(crate) const FAULTS: &[Fault] = &[
    Fault {
        name: "intermittent: every second pair of frames is lost",
        happen: |stage, pair| {
            if stage.tick % 2 == 0 {
                stage.send(&pair)
            }
        },
        estimate: Predicts(1e-9),
        ..HARMLESS
    },
    Fault {
        name: "off: frames stop",
        happen: |_, _| {},
        health: Some((Health::Stale, 6)),
        estimate: Predicts(DRIFT_M),
        ..HARMLESS
    },
    Fault {
        name: "twice: every frame is sent again",
        happen: |stage, pair| {
            stage.send(&pair);
            stage.send(&pair);
        },
        ..HARMLESS
    },
    Fault {
        name: "out of order: the frames before come again after the new ones",
        happen: |stage, pair| {
            let before = stage.before;
            stage.send(&pair);
            stage.send(&before);
        },
        ..HARMLESS
    },
    Fault {
        name: "delayed: frames come one tick late",
        happen: |stage, _| {
            let before = stage.before;
            stage.send(&before);
        },
        estimate: Predicts(0.011),
        ..HARMLESS
    },
    Fault {
        name: "wrong: every checksum",
        happen: |stage, pair| {
            stage.send(&pair.map(|frame| altered(&frame, |data| data[5] ^= 0x5A)))
        },
        health: Some((Health::Faulty, 6)),
        estimate: Predicts(DRIFT_M),
        ..HARMLESS
    },
    Fault {
        name: "garbage: every bit of the payload is turned over",
        happen: |stage, pair| {
            stage.send(&pair.map(|frame| {
                altered(&frame, |data| {
                    data.iter_mut().for_each(|byte| *byte = !*byte)
                })
            }))
        },
        health: Some((Health::Faulty, 6)),
        estimate: Predicts(DRIFT_M),
        ..HARMLESS
    },
    Fault {
        name: "short: three bytes of payload",
        happen: |stage, pair| stage.send(&pair.map(|frame| shortened(&frame))),
        health: Some((Health::Faulty, 6)),
        estimate: Predicts(DRIFT_M),
        ..HARMLESS
    },
    Fault {
        name: "stuck: an encoder repeats its last frames",
        happen: |stage, _| {
            let first = *stage.stuck.get_or_insert(stage.before);
            stage.send(&first);
        },
        health: Some((Health::Stale, 6)),
        estimate: Predicts(DRIFT_M),
        ..HARMLESS
    },
    Fault {
        name: "one wheel stuck: its frames are in order, its count stands",
        happen: |stage, _| stage.send_counts([0.0, 1.0]),
        estimate: Believes,
        ..HARMLESS
    },
    Fault {
        name: "one wheel reversed: it counts backwards",
        happen: |stage, _| stage.send_counts([-1.0, 1.0]),
        estimate: Believes,
        ..HARMLESS
    },
    Fault {
        name: "flood: two hundred frames of other nodes a tick",
        happen: |stage, pair| {
            let foreign = Frame::data_frame(StandardId::new(0x300).unwrap(), &[0; 8]).unwrap();
            (0..200).for_each(|_| stage.send_frame(&foreign));
            stage.send(&pair);
        },
        ..HARMLESS
    },
    Fault {
        name: "requests: remote frames on the encoder's identifier",
        happen: |stage, pair| {
            stage.send_frame(&Frame::remote_frame(LEFT_ID, 6).unwrap());
            stage.send(&pair);
        },
        ..HARMLESS
    },
    Fault {
        name: "error-passive: the controller counts many errors",
        happen: |stage, pair| {
            stage.error(ErrorClass::Controller, [0, 0x30, 0, 0, 0, 0, 0, 0]);
            stage.send(&pair);
        },
        bus: Some((BusState::Passive, 1)),
        end: |stage| stage.error(ErrorClass::Controller, [0, 0x40, 0, 0, 0, 0, 0, 0]),
        ..HARMLESS
    },
    Fault {
        name: "bus-off: the controller leaves the bus, and is restarted",
        happen: |stage, _| stage.error(ErrorClass::BusOff, [0; 8]),
        health: Some((Health::Faulty, 1)),
        bus: Some((BusState::Off, 1)),
        estimate: Predicts(DRIFT_M),
        end: |stage| stage.error(ErrorClass::Restarted, [0; 8]),
        ..HARMLESS
    },
    Fault {
        name: "down: the interface is switched off and on",
        happen: |stage, _| {
            if stage.tick == 1 {
                stage.interface.set(&["down"])
            }
        },
        health: Some((Health::Faulty, 1)),
        bus: Some((BusState::Down, 1)),
        estimate: Predicts(DRIFT_M),
        end: |stage| {
            stage.interface.up();
            stage.sender = stage.interface.sender(); // The old one still has to say that the network was down.
        },
        recovers: 2,
        ..HARMLESS
    },
    Fault {
        name: "gone: the interface is deleted and made again",
        happen: |stage, _| {
            if stage.tick == 1 {
                stage.interface.delete()
            }
        },
        health: Some((Health::Faulty, 1)),
        bus: Some((BusState::Down, 1)),
        estimate: Predicts(DRIFT_M),
        end: |stage| {
            stage.interface.create();
            stage.sender = stage.interface.sender();
        },
        recovers: 18,
        ..HARMLESS
    },
    Fault {
        name: "clock set forward by an hour",
        happen: |stage, pair| {
            if stage.tick == 1 {
                stage.time.step(3_600_000_000_000)
            }
            stage.send(&pair);
        },
        ..HARMLESS
    },
    Fault {
        name: "clock set back by an hour",
        happen: |stage, pair| {
            if stage.tick == 1 {
                stage.time.step(-3_600_000_000_000)
            }
            stage.send(&pair);
        },
        ..HARMLESS
    },
    Fault {
        name: "clock set forward by a second",
        happen: |stage, pair| {
            if stage.tick == 1 {
                stage.time.step(1_000_000_000)
            }
            stage.send(&pair);
        },
        ..HARMLESS
    },
    Fault {
        name: "clock set back by a second",
        happen: |stage, pair| {
            if stage.tick == 1 {
                stage.time.step(-1_000_000_000)
            }
            stage.send(&pair);
        },
        ..HARMLESS
    },
];

fn altered(frame: &Frame, alter: impl FnOnce(&mut [u8])) -> Frame {
    let mut data = frame.data().to_vec();
    alter(&mut data);
    Frame::data_frame(frame.id().unwrap(), &data).unwrap()
}

fn shortened(frame: &Frame) -> Frame {
    Frame::data_frame(frame.id().unwrap(), &frame.data()[..3]).unwrap()
}
