//! The table.

use coloc_shm_types::BusState::{Active, Down, Off as BusOff, Passive, Warning};
use coloc_shm_types::Health::{Faulty, Ok, Stale};

use super::Fault;
use super::Place::{Anywhere, Interface, NoHardware, Virtual};
use super::Way::{Kept, Turns};
use super::Word::{Delayed, Garbage, Intermittent, Off, Slow, Stuck, Wrong};
use super::script::{self, Script};
use crate::rig::{TRACK_M, WAY_PER_PERIOD_M};

/// Odometry is stale when its newest sample is older than 0.1 s: at 50 Hz, on the sixth tick without one.
const STALE: u32 = 6;

/// Thirty pairs are lost: a counter of four bits says only that it were fourteen, or thirty, or forty-six.
const LOST_30: u64 = 2 * (30 % 16);

/// What is not said otherwise: thirty ticks, unnoticed, nothing lost.
const USUAL: Fault = Fault {
    name: "",
    word: Off,
    made: "",
    place: Anywhere,
    ticks: 30,
    first_ticks: 0,
    script: Script::NOTHING,
    health: &[],
    bus: &[],
    counts: &[],
    estimate: Kept,
    again: 1,
};

/// Every fault.
pub const FAULTS: &[Fault] = &[
    // --- Frames that do not come, or not when they should. ---
    Fault {
        name: "frames stop",
        word: Off,
        made: "no frame for 30 ticks",
        script: Script::each(script::silence),
        health: &[(STALE, Stale), (31, Ok)],
        counts: &[script::alive_skips(LOST_30)],
        ..USUAL
    },
    Fault {
        name: "one wheel's frames stop",
        word: Off,
        made: "only the right wheel's frames come",
        script: Script::each(script::only_right),
        health: &[(STALE, Stale), (31, Ok)],
        counts: &[script::alive_skips(LOST_30 / 2)],
        ..USUAL
    },
    Fault {
        name: "frames come at 10 Hz",
        word: Slow,
        made: "four of five pairs are lost",
        script: Script::each(script::every_fifth),
        counts: &[script::alive_skips(48)],
        ..USUAL
    },
    Fault {
        name: "frames come at 5 Hz",
        word: Slow,
        made: "nine of ten pairs are lost",
        script: Script::each(script::every_tenth),
        health: &[
            (STALE, Stale),
            (10, Ok),
            (16, Stale),
            (20, Ok),
            (26, Stale),
            (30, Ok),
        ],
        counts: &[script::alive_skips(54)],
        ..USUAL
    },
    Fault {
        name: "a loose contact",
        word: Intermittent,
        made: "eight ticks without a frame, two with, and again",
        script: Script::each(script::two_of_ten),
        health: &[
            (STALE, Stale),
            (9, Ok),
            (16, Stale),
            (19, Ok),
            (26, Stale),
            (29, Ok),
        ],
        counts: &[script::alive_skips(48)],
        ..USUAL
    },
    Fault {
        name: "frames come late",
        word: Delayed,
        made: "every frame arrives three ticks late, the last ones all at once",
        script: Script {
            end: script::deliver_late,
            ..Script::each(script::three_late)
        },
        again: 2,
        ..USUAL
    },
    Fault {
        name: "frames come twice",
        word: Stuck,
        made: "every frame is sent twice",
        script: Script::each(script::twice),
        counts: &[script::alive_repeats(60)],
        ..USUAL
    },
    Fault {
        name: "frames come out of order",
        word: Wrong,
        made: "every pair is held back until the next has come",
        script: Script::each(script::swapped),
        counts: &[script::alive_skips(30)],
        ..USUAL
    },
    Fault {
        name: "the alive counter skips",
        word: Intermittent,
        made: "every other pair is lost",
        script: Script::each(script::every_other),
        counts: &[script::alive_skips(30)],
        ..USUAL
    },
    Fault {
        name: "the sender hangs",
        word: Stuck,
        made: "the same two frames again and again",
        script: Script::each(script::hang),
        health: &[(STALE + 1, Stale), (31, Ok)],
        counts: &[script::alive_repeats(58)],
        ..USUAL
    },
    // --- Frames that say something else than they should. ---
    Fault {
        name: "the checksum is wrong",
        word: Garbage,
        made: "the last byte of every frame is inverted",
        script: Script::each(script::wrong_checksum),
        health: &[(STALE, Faulty), (31, Ok)],
        counts: &[script::checksum_errors(60), script::alive_skips(LOST_30)],
        ..USUAL
    },
    Fault {
        name: "the payload is short",
        word: Garbage,
        made: "every frame ends after four bytes",
        script: Script::each(script::short),
        health: &[(STALE, Faulty), (31, Ok)],
        counts: &[script::malformed(60), script::alive_skips(LOST_30)],
        ..USUAL
    },
    Fault {
        name: "garbage payloads",
        word: Garbage,
        made: "eight random bytes under both identifiers",
        script: Script::each(script::garbage),
        health: &[(STALE, Faulty), (31, Ok)],
        counts: &[script::checksum_errors(60), script::alive_skips(LOST_30)],
        ..USUAL
    },
    Fault {
        name: "the encoder counter wraps",
        word: Wrong,
        made: "the encoders pass 2³² in the fifth tick",
        first_ticks: u32::MAX - 30_000,
        ticks: 10,
        script: Script::each(script::drive),
        ..USUAL
    },
    Fault {
        name: "the encoder restarts",
        word: Wrong,
        made: "both counters jump, to where they go on",
        ticks: 3,
        script: Script {
            begin: script::jump,
            ..Script::each(script::drive)
        },
        counts: &[script::implausible(4), script::alive_skips(4)],
        ..USUAL
    },
    Fault {
        name: "one wheel stuck",
        word: Stuck,
        made: "the left encoder counts no more, its frames go on",
        ticks: 20,
        script: Script {
            begin: |rig| rig.wheels.scale[0] = 0.0,
            end: script::mend_wheels,
            ..Script::each(script::drive)
        },
        estimate: Turns(20.0 * WAY_PER_PERIOD_M / TRACK_M),
        ..USUAL
    },
    Fault {
        name: "one wheel reversed",
        word: Wrong,
        made: "the left encoder counts backwards",
        ticks: 20,
        script: Script {
            begin: |rig| rig.wheels.scale[0] = -1.0,
            end: script::mend_wheels,
            ..Script::each(script::drive)
        },
        estimate: Turns(40.0 * WAY_PER_PERIOD_M / TRACK_M),
        ..USUAL
    },
    Fault {
        name: "a second node on our identifiers",
        word: Wrong,
        made: "another robot's encoders send well-formed frames under the same identifiers",
        script: Script::each(script::second_node),
        counts: &[script::implausible(60)],
        ..USUAL
    },
    // --- What the controller reports. ---
    Fault {
        name: "error frames",
        word: Intermittent,
        made: "one error frame of each class that leaves the controller active",
        place: NoHardware,
        ticks: 10,
        script: Script::each(script::error_frame),
        counts: &[script::error_frames(8), script::rx_overflows(1)],
        ..USUAL
    },
    Fault {
        name: "error warning",
        word: Intermittent,
        made: "the controller reports 96 errors, then that it is active again",
        place: NoHardware,
        script: Script {
            begin: script::error_warning,
            end: script::error_active,
            ..Script::each(script::drive)
        },
        bus: &[(1, Warning), (31, Active)],
        counts: &[script::error_frames(2)],
        ..USUAL
    },
    Fault {
        name: "error passive",
        word: Intermittent,
        made: "the controller reports 128 errors, then that it is active again",
        place: NoHardware,
        script: Script {
            begin: script::error_passive,
            end: script::error_active,
            ..Script::each(script::drive)
        },
        bus: &[(1, Passive), (31, Active)],
        counts: &[script::error_frames(2)],
        ..USUAL
    },
    Fault {
        name: "bus-off and restart",
        word: Off,
        made: "the controller reports that it left the bus, then that it was restarted",
        place: NoHardware,
        script: Script {
            begin: script::bus_off,
            end: script::restarted,
            ..Script::each(script::silence)
        },
        health: &[(1, Faulty), (31, Ok)],
        bus: &[(1, BusOff), (31, Active)],
        counts: &[script::error_frames(2), script::alive_skips(LOST_30)],
        ..USUAL
    },
    // --- What happens to the interface and the socket. ---
    Fault {
        name: "the interface goes down and up",
        word: Off,
        made: "`ip link set … down` with frames in the queue, then `up`",
        place: Interface,
        script: Script {
            end: |rig| rig.switch(true),
            ..Script::each(script::unplug)
        },
        health: &[(1, Faulty), (31, Ok)],
        bus: &[(1, Down), (31, Active)],
        counts: &[script::alive_skips(2 * (29 % 16))],
        ..USUAL
    },
    Fault {
        name: "the interface is deleted and made again",
        word: Off,
        made: "`ip link del …`, then `add` and `up`",
        place: Virtual,
        script: Script {
            begin: |rig| rig.exist(false),
            end: |rig| rig.exist(true),
            ..Script::each(script::silence)
        },
        health: &[(1, Faulty), (32, Stale), (33, Ok)],
        bus: &[(1, Down), (32, Active)],
        counts: &[script::reopens(1)],
        again: 3,
        ..USUAL
    },
    Fault {
        name: "the daemon's socket is closed",
        word: Off,
        made: "its descriptor is closed by somebody else",
        ticks: 1,
        script: Script {
            begin: |rig| rig.close_socket(false),
            ..Script::each(script::silence)
        },
        health: &[(1, Faulty), (2, Ok)],
        bus: &[(1, Down), (2, Active)],
        counts: &[script::reopens(1), script::alive_skips(4)],
        ..USUAL
    },
    Fault {
        name: "the daemon's socket becomes another file",
        word: Wrong,
        made: "its descriptor is closed, and its number given to another file",
        ticks: 1,
        script: Script {
            begin: |rig| rig.close_socket(true),
            ..Script::each(script::silence)
        },
        health: &[(1, Faulty), (2, Ok)],
        bus: &[(1, Down), (2, Active)],
        counts: &[script::reopens(1), script::alive_skips(4)],
        ..USUAL
    },
    Fault {
        name: "the receive buffer overflows",
        word: Intermittent,
        made: "200 pairs of frames between two ticks, where the kernel has not granted more than its usual buffer",
        place: Interface,
        ticks: 2,
        script: Script {
            begin: script::usual_buffer,
            ..Script::each(script::flood)
        },
        counts: &[
            script::rx_overflows(1).or_more(),
            script::alive_repeats(1).or_more(),
        ],
        ..USUAL
    },
    // --- What happens to the clock. ---
    Fault {
        name: "the clock is set 1 s ahead",
        word: Wrong,
        made: "the clock of the stamps steps before the frames of a tick come",
        script: Script {
            begin: |rig| rig.clock.step(SECOND_NS),
            ..Script::each(script::drive)
        },
        ..USUAL
    },
    Fault {
        name: "the clock is set 1 s back",
        word: Wrong,
        made: "the clock of the stamps steps before the frames of a tick come",
        script: Script {
            begin: |rig| rig.clock.step(-SECOND_NS),
            ..Script::each(script::drive)
        },
        ..USUAL
    },
    Fault {
        name: "the clock is set 1 h ahead",
        word: Wrong,
        made: "the clock of the stamps steps before the frames of a tick come",
        script: Script {
            begin: |rig| rig.clock.step(3600 * SECOND_NS),
            ..Script::each(script::drive)
        },
        ..USUAL
    },
    Fault {
        name: "the clock is set 1 h back",
        word: Wrong,
        made: "the clock of the stamps steps before the frames of a tick come",
        script: Script {
            begin: |rig| rig.clock.step(-3600 * SECOND_NS),
            ..Script::each(script::drive)
        },
        ..USUAL
    },
    Fault {
        name: "the clock is set 5 ms ahead",
        word: Wrong,
        made: "the clock of the stamps steps before the frames of a tick come",
        script: Script {
            begin: |rig| rig.clock.step(5 * MILLISECOND_NS),
            ..Script::each(script::drive)
        },
        ..USUAL
    },
    Fault {
        name: "the clock is set 5 ms back",
        word: Wrong,
        made: "the clock of the stamps steps before the frames of a tick come",
        script: Script {
            begin: |rig| rig.clock.step(-5 * MILLISECOND_NS),
            ..Script::each(script::drive)
        },
        ..USUAL
    },
    Fault {
        name: "the clock is set 119 ms ahead",
        word: Wrong,
        made: "the clock of the stamps steps before the frames of a tick come",
        script: Script {
            begin: |rig| rig.clock.step(119 * MILLISECOND_NS),
            ..Script::each(script::drive)
        },
        ..USUAL
    },
    Fault {
        name: "the clock is set 119 ms back",
        word: Wrong,
        made: "the clock of the stamps steps before the frames of a tick come",
        script: Script {
            begin: |rig| rig.clock.step(-119 * MILLISECOND_NS),
            ..Script::each(script::drive)
        },
        ..USUAL
    },
    Fault {
        name: "the clock is set 1 h ahead under way",
        word: Wrong,
        made: "the clock of the stamps steps between the frames of a tick and their read",
        script: Script::each(|rig, tick| {
            script::drive(rig, tick);
            rig.clock.step(if tick == 1 { 3600 * SECOND_NS } else { 0 });
        }),
        ..USUAL
    },
    Fault {
        name: "the clock is set 1 h back under way",
        word: Wrong,
        made: "the clock of the stamps steps between the frames of a tick and their read",
        script: Script::each(|rig, tick| {
            script::drive(rig, tick);
            rig.clock
                .step(if tick == 1 { -3600 * SECOND_NS } else { 0 });
        }),
        ..USUAL
    },
    Fault {
        name: "the clock is set 30 ms ahead under way",
        word: Wrong,
        made: "the clock of the stamps steps between the frames of a tick and their read",
        script: Script::each(|rig, tick| {
            script::drive(rig, tick);
            rig.clock
                .step(if tick == 1 { 30 * MILLISECOND_NS } else { 0 });
        }),
        ..USUAL
    },
    Fault {
        name: "the clock is set 30 ms back under way",
        word: Wrong,
        made: "the clock of the stamps steps between the frames of a tick and their read",
        script: Script::each(|rig, tick| {
            script::drive(rig, tick);
            rig.clock
                .step(if tick == 1 { -30 * MILLISECOND_NS } else { 0 });
        }),
        ..USUAL
    },
];

const MILLISECOND_NS: i64 = 1_000_000;
const SECOND_NS: i64 = 1_000_000_000;
