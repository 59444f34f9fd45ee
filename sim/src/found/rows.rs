//! The rows, but for those of outages.

use coloc_estimator::TrustJump;

use super::bar::Bar;
use super::experiment::{Drive, Event, Experiment, Lie, Sensor, Start, Tail};

/// Robots of a row that shows 99.9 %, and of one that shows 99.5 %.
const MANY: usize = 10_000;
const SOME: usize = 600;

/// Where the position is known to 1 m and the heading is not.
const TURNED: Start = Start::Position(1.0);

/// When robots are carried, and sources begin to lie \[s\].
const EVENT_S: f64 = 20.0;

pub(super) fn starts() -> Vec<Experiment> {
    let mut rows = vec![Experiment {
        bars: vec![
            Bar::FoundBy(15.0),
            Bar::Median(4.8),
            Bar::NoWrongTakeover,
            Bar::Nees,
        ],
        document: "all by 15 s, 4.8 s".into(),
        ..heading_unknown(
            "heading unknown, many starts, σ 1 m, 5 Hz, 1 m/s",
            MANY,
            1.0,
            5,
        )
    }];
    rows.extend(grid());
    rows.extend(others());
    rows
}

fn heading_unknown(name: &str, robots: usize, sigma: f64, hz: u32) -> Experiment {
    Experiment {
        start: TURNED,
        sensors: vec![Sensor::fix(sigma).at_hz(hz)],
        ..Experiment::new(name, robots)
    }
}

/// σ \[m\], rate \[Hz\], way, by when half of them are found in the prototype, and all here \[s\].
type Cell = (f64, u32, Way, f64, f64);

/// How it drives, in words.
type Way = (&'static str, Drive);

const FAST: Way = ("1 m/s", Drive::Wander(1.0));
const SLOW: Way = ("0.2 m/s", Drive::Wander(0.2));
const STOPS: Way = ("stop and go", Drive::StopAndGo);
const SPINS: Way = ("10 s spinning first", Drive::SpinFirst);

/// The prototype's medians of those that stop, or spin, are not known: all were found by 15 s.
const GRID: [Cell; 18] = [
    (0.02, 5, FAST, 2.0, 15.0),
    (0.3, 5, FAST, 2.8, 15.0),
    (1.0, 5, FAST, 4.8, 15.0),
    (0.02, 1, FAST, 6.0, 15.0),
    (0.3, 1, FAST, 6.0, 15.0),
    (1.0, 1, FAST, 7.0, 15.0),
    (0.02, 5, SLOW, 2.0, 60.0),
    (0.3, 5, SLOW, 6.4, 60.0),
    (1.0, 5, SLOW, 13.0, 60.0),
    (0.02, 1, SLOW, 6.0, 60.0),
    (0.3, 1, SLOW, 11.0, 60.0),
    (1.0, 1, SLOW, 22.0, 60.0),
    (0.02, 5, STOPS, 15.0, 15.0),
    (0.3, 5, STOPS, 15.0, 15.0),
    (1.0, 5, STOPS, 15.0, 15.0),
    (0.02, 5, SPINS, 15.0, 15.0),
    (0.3, 5, SPINS, 15.0, 15.0),
    (1.0, 5, SPINS, 15.0, 15.0),
];

/// Speeds and ways, rates and σ.
fn grid() -> impl Iterator<Item = Experiment> {
    GRID.into_iter()
        .map(|(sigma, hz, (way, drive), median, by)| Experiment {
            drive,
            bars: vec![Bar::FoundBy(by), Bar::Median(median), Bar::NoWrongTakeover],
            document: format!("half by {median} s, all by {by} s"),
            watched_s: 121.0,
            ..heading_unknown(
                &format!("heading unknown, σ {sigma} m, {hz} Hz, {way}"),
                SOME,
                sigma,
                hz,
            )
        })
}

fn others() -> Vec<Experiment> {
    let pose_unknown = |name, sensors, median, document: &str| Experiment {
        start: Start::Nothing,
        sensors,
        bars: vec![
            Bar::FoundBy(15.0),
            Bar::Median(median),
            Bar::NoWrongTakeover,
        ],
        document: document.into(),
        ..Experiment::new(name, SOME)
    };
    let (fix, neighbour) = (Sensor::fix(0.3), Sensor::neighbour());
    let slow = |name, start, drive, bars| Experiment {
        start,
        drive,
        sensors: vec![Sensor::slow()],
        bars,
        watched_s: 121.0,
        document: "all by 15 s, 3.2; at 0.2 m/s 38 % by 20 s, all by 60 s, 21".into(),
        ..Experiment::new(name, SOME)
    };
    vec![
        pose_unknown("pose unknown, fixes", vec![fix], 2.8, "2.8"),
        pose_unknown(
            "pose unknown, a neighbour",
            vec![neighbour],
            5.2,
            "5.2; NEES 2.40",
        ),
        pose_unknown(
            "pose unknown, both",
            vec![fix, neighbour],
            2.8,
            "2.8; NEES 2.44",
        ),
        Experiment {
            start: Start::Nothing,
            sensors: vec![fix, neighbour],
            event: Event::Lie(2, Lie::Shift(30.0)),
            bars: vec![Bar::NeverOk],
            document: "never ok".into(),
            ..Experiment::new("pose unknown, a receiver, a neighbour lies by 30 m", SOME)
        },
        Experiment {
            start: Start::Nothing,
            sensors: vec![fix, neighbour, neighbour],
            event: Event::Lie(1, Lie::Shift(30.0)),
            bars: vec![Bar::FoundBy(15.0), Bar::Median(5.1), Bar::NoWrongTakeover],
            document: "all by 15 s, 5.1; NEES 1.98".into(),
            ..Experiment::new(
                "pose unknown, two neighbours, a receiver lies by 30 m",
                SOME,
            )
        },
        slow(
            "slow receiver, heading unknown",
            TURNED,
            Drive::Wander(1.0),
            vec![Bar::FoundBy(15.0), Bar::Median(3.2), Bar::NoWrongTakeover],
        ),
        slow(
            "slow receiver, pose unknown",
            Start::Nothing,
            Drive::Wander(1.0),
            vec![Bar::FoundBy(15.0), Bar::Median(3.2), Bar::NoWrongTakeover],
        ),
        slow(
            "slow receiver, heading unknown, 0.2 m/s",
            TURNED,
            Drive::Wander(0.2),
            vec![Bar::FoundBy(60.0), Bar::Median(21.0), Bar::NoWrongTakeover],
        ),
        Experiment {
            start: Start::Wrong(1100.0),
            trust: TrustJump::Receiver,
            bars: vec![Bar::FoundBy(20.0), Bar::Median(5.0), Bar::NoWrongTakeover],
            document: "all by 15 s, 5.0".into(),
            ..Experiment::new("wrong start, 1,100 m away", SOME)
        },
        heavy(
            "heading unknown, 5 % of the fixes five times as wrong",
            Tail::Mixed(0.05, 5.0),
        ),
        heavy("heading unknown, fixes of Student's t₄", Tail::Student),
    ]
}

/// A real receiver's tails.
fn heavy(name: &str, tail: Tail) -> Experiment {
    Experiment {
        start: TURNED,
        sensors: vec![Sensor::fix(0.3).with(tail)],
        bars: vec![Bar::FoundBy(20.0), Bar::NoWrongTakeover],
        beyond: true,
        ..Experiment::new(name, SOME)
    }
}

/// A robot that is carried at [`EVENT_S`] so far while it drives \[m\].
fn kidnapped(name: &str, robots: usize, far: [f64; 2], sensors: Vec<Sensor>) -> Experiment {
    Experiment {
        sensors,
        event_s: EVENT_S,
        event: Event::Carried(far),
        ..Experiment::new(name, robots)
    }
}

pub(super) fn carried() -> Vec<Experiment> {
    let mut rows = vec![Experiment {
        bars: vec![
            Bar::FoundBy(20.0),
            Bar::Median(13.8),
            Bar::NoWrongTakeover,
            Bar::WrongAtMost(1.5),
            Bar::Nees,
        ],
        document: "99.99 % by 20 s, 13.8".into(),
        ..kidnapped(
            "driving, 5 m to 1 km",
            MANY,
            [5.0, 1000.0],
            vec![Sensor::fix(0.3)],
        )
    }];
    rows.extend(kidnapped_rows());
    rows.extend(standing());
    rows
}

/// Carried so far while driving \[m\]; all found by the first and half of them by the second \[s\].
fn kidnapped_row(
    name: &str,
    far: f64,
    sensors: &[Sensor],
    [by, median]: [f64; 2],
    document: &str,
) -> Experiment {
    let far = [far, far * (1.0 + 1e-9)];
    Experiment {
        bars: vec![Bar::FoundBy(by), Bar::Median(median), Bar::NoWrongTakeover],
        document: document.into(),
        ..kidnapped(&format!("driving, {name}"), SOME, far, sensors.to_vec())
    }
}

fn kidnapped_rows() -> Vec<Experiment> {
    let (fix, coarse, exact) = (Sensor::fix(0.3), Sensor::fix(1.0), Sensor::fix(0.02));
    let (neighbour, slow) = (Sensor::neighbour(), Sensor::slow());
    let heavy = fix.with(Tail::Mixed(0.05, 5.0));
    let beyond = |row| Experiment {
        beyond: true,
        ..row
    };
    let (usual, late, soon) = ([20.0, 13.8], [60.0, 14.5], [15.0, 4.8]);
    let row = kidnapped_row;
    let some = "all by 15 s, 14.2";
    vec![
        row("5 m, σ 1 m", 5.0, &[coarse], usual, "13.8"),
        row(
            "30 m, σ 1 m, 1 Hz",
            30.0,
            &[coarse.at_hz(1)],
            [20.0, 17.0],
            "17.0",
        ),
        beyond(row(
            "1 m, σ 0.3 m",
            1.0,
            &[fix],
            late,
            "84 % by 15 s, 99.7 % by 20 s",
        )),
        beyond(row(
            "0.3 m, σ 0.3 m",
            0.3,
            &[fix],
            late,
            "78 %, 99 %; NEES 3.78",
        )),
        row("0.3 m, σ 0.02 m", 0.3, &[exact], usual, "all by 20 s"),
        row(
            "30 m, two receivers",
            30.0,
            &[fix, fix],
            soon,
            "4.8; NEES 3.01",
        ),
        row(
            "30 m, receiver and neighbour",
            30.0,
            &[fix, neighbour],
            soon,
            "5.1",
        ),
        row(
            "30 m, two neighbours",
            30.0,
            &[neighbour, neighbour],
            soon,
            "8.0",
        ),
        row(
            "30 m, two neighbours and a receiver",
            30.0,
            &[neighbour, neighbour, fix],
            soon,
            "",
        ),
        row("3 m, slow receiver", 3.0, &[slow], [20.0, 14.2], some),
        row("30 m, slow receiver", 30.0, &[slow], [20.0, 14.2], some),
        row("1 km, slow receiver", 1000.0, &[slow], [20.0, 14.2], some),
        beyond(row(
            "30 m, 5 % of the fixes five times as wrong",
            30.0,
            &[heavy],
            usual,
            "",
        )),
    ]
}

/// Carried while it stands; it drives off 15 s later.
fn standing() -> Vec<Experiment> {
    let row = |name, robots, far: [f64; 2], sigma| Experiment {
        drive: Drive::Pausing([10.0, EVENT_S + DRIVES_OFF_S]),
        event_s: EVENT_S,
        event: Event::Carried(far),
        sensors: vec![Sensor::fix(sigma)],
        watched_s: 100.0,
        bars: vec![
            Bar::PlacedBy(20.0),
            Bar::FoundBy(DRIVES_OFF_S + 10.0),
            Bar::RightAfter(6.0),
            Bar::NoWrongTakeover,
        ],
        document: "position by 17.2 s; ok 1–2 s after driving off".into(),
        ..Experiment::new(name, robots)
    };
    vec![
        row(
            "standing, 0.1 to 0.3 m, σ 0.033 m",
            MANY / 5,
            [0.1, 0.3],
            0.033,
        ),
        row("standing, 0.1 to 1 m, σ 8 mm", MANY / 5, [0.1, 1.0], 0.008),
        row("standing, 0.9 to 3 m, σ 0.3 m", MANY / 5, [0.9, 3.0], 0.3),
        row("standing, 3 to 100 m, σ 0.3 m", MANY / 5, [3.0, 100.0], 0.3),
        row("standing, 3 to 100 m, σ 1 m", MANY / 5, [3.0, 100.0], 1.0),
        Experiment {
            bars: vec![Bar::NoWrongTakeover],
            beyond: true,
            document: "noticed after 17 s; wrong meanwhile 14 s".into(),
            ..row("standing, 0.3 m, σ 0.3 m", SOME, [0.3, 0.3001], 0.3)
        },
    ]
}

/// Of which it is asked what can be known.
pub(super) fn for_exact() -> Vec<Experiment> {
    let start = Experiment {
        start: Start::Nothing,
        ..Experiment::new("pose unknown, fixes", MANY)
    };
    let mut rows = vec![start];
    rows.extend(standing().into_iter().filter(|it| !it.beyond));
    rows
}

/// After it was carried \[s\].
const DRIVES_OFF_S: f64 = 15.0;

pub(super) fn liars() -> Vec<Experiment> {
    let (fix, neighbour) = (Sensor::fix(0.3), Sensor::neighbour());
    let teams = [
        ("three receivers, one", 10.0, vec![fix, fix, fix]),
        (
            "three neighbours, one",
            2.0,
            vec![neighbour, neighbour, neighbour],
        ),
        (
            "two neighbours and a receiver that",
            10.0,
            vec![neighbour, neighbour, fix],
        ),
        (
            "two receivers and a neighbour that",
            2.0,
            vec![fix, fix, neighbour],
        ),
    ];
    let mut rows = Vec::new();
    for (team, far, sensors) in teams {
        let lies = [
            (format!("is off by {far} m"), 0.0, Lie::Shift(far)),
            (format!("jumps by {far} m"), EVENT_S, Lie::Shift(far)),
            ("is turned by 0.5 rad".into(), EVENT_S, Lie::Turn(0.5)),
            ("drifts at 0.5 m/s".into(), EVENT_S, Lie::Drift(0.5)),
            ("drifts at 0.2 m/s".into(), EVENT_S, Lie::Drift(0.2)),
        ];
        rows.extend(lies.map(|(what, event_s, lie)| Experiment {
            event_s,
            ..liar(format!("{team} {what}"), &sensors, 3, lie)
        }));
    }
    rows
}

fn liar(name: String, sensors: &[Sensor], number: usize, lie: Lie) -> Experiment {
    Experiment {
        sensors: sensors.to_vec(),
        event_s: EVENT_S,
        event: Event::Lie(number, lie),
        to_the_end: true,
        bars: vec![
            Bar::NoWrongTakeover,
            Bar::WrongAtMost(3.0),
            Bar::LiarNamed,
            Bar::HonestUnnamed,
        ],
        ..Experiment::new(name, SOME)
    }
}

pub(super) fn alone() -> Vec<Experiment> {
    let mut rows = lone_liars();
    rows.extend(blackouts());
    rows.extend(pairs());
    rows.push(Experiment {
        start: Start::Nothing,
        silence_s: [1.1, 40.0],
        beyond: true,
        watched_s: 121.0,
        bars: vec![Bar::LostBy(13.5), Bar::FoundBy(55.0), Bar::NoWrongTakeover],
        ..Experiment::new("pose unknown, nobody speaks from 1 to 40 s", SOME)
    });
    rows.push(Experiment {
        start: TURNED,
        drive: Drive::Parked,
        bars: vec![Bar::NeverOk],
        ..Experiment::new("heading unknown, parked", SOME)
    });
    rows
}

/// What is known of it is in the settings, not in the data: no bars but with trust in the receiver.
fn lone_liars() -> Vec<Experiment> {
    let row = |name: &str, trust, lie, bars, document: &str| Experiment {
        trust,
        bars,
        document: document.into(),
        beyond: true,
        ..liar(name.into(), &[Sensor::fix(0.3)], 1, lie)
    };
    let (robot, receiver) = (TrustJump::Robot, TrustJump::Receiver);
    let never = vec![Bar::NoWrongTakeover];
    let (jump, drift) = (Lie::Shift(10.0), Lie::Drift);
    vec![
        row(
            "jumps by 10 m, trust robot",
            robot,
            jump,
            vec![],
            "follows after 12 s",
        ),
        row(
            "jumps by 10 m, trust receiver",
            receiver,
            jump,
            never,
            "never",
        ),
        row(
            "drifts at 0.5 m/s, trust robot",
            robot,
            drift(0.5),
            vec![],
            "7 % end wrong",
        ),
        row(
            "drifts at 5 cm/s, trust robot",
            robot,
            drift(0.05),
            vec![],
            "70 % end wrong",
        ),
        row(
            "drifts at 5 cm/s, trust receiver",
            receiver,
            drift(0.05),
            vec![],
            "48 % end wrong",
        ),
    ]
}

/// 105 wrong fixes after a minute without any.
fn blackouts() -> Vec<Experiment> {
    let row = |name: &str, trust, hz, lie, bars: Vec<Bar>, document: &str| Experiment {
        trust,
        sensors: vec![Sensor::fix(0.3).at_hz(hz)],
        silence_s: [EVENT_S, EVENT_S + 60.0],
        event_s: EVENT_S + 60.0,
        beyond: bars.is_empty(),
        bars,
        document: document.into(),
        ..liar(name.into(), &[], 1, lie)
    };
    let (robot, receiver) = (TrustJump::Robot, TrustJump::Receiver);
    let (shift, place) = (Lie::ShiftFor(42.0, 105), Lie::PlaceFor(85.0, 105));
    let never = || {
        vec![
            Bar::NoWrongTakeover,
            Bar::WrongAtMost(1.5),
            Bar::FoundBy(40.0),
        ]
    };
    vec![
        row(
            "105 wrong fixes around a place",
            robot,
            5,
            place,
            never(),
            "never followed",
        ),
        row(
            "105 shifted fixes, 10 Hz",
            robot,
            10,
            shift,
            never(),
            "never followed",
        ),
        row(
            "105 shifted fixes, 5 Hz",
            robot,
            5,
            shift,
            vec![],
            "wrong for 8.8 s",
        ),
        row(
            "105 shifted fixes, 5 Hz, trust receiver",
            receiver,
            5,
            shift,
            never(),
            "never",
        ),
    ]
}

/// Two receivers, or a receiver and a neighbour: nobody knows who is right but for the wheels.
fn pairs() -> Vec<Experiment> {
    let fix = Sensor::fix(0.3);
    let row = |name: &str, lie, document: &str| Experiment {
        bars: vec![],
        document: document.into(),
        beyond: true,
        ..liar(name.into(), &[fix, fix], 2, lie)
    };
    vec![
        Experiment {
            bars: vec![
                Bar::NoWrongTakeover,
                Bar::AlwaysOk,
                Bar::LiarNamed,
                Bar::HonestUnnamed,
            ],
            ..row(
                "two receivers, one jumps by 10 m",
                Lie::Shift(10.0),
                "ok throughout",
            )
        },
        row(
            "two receivers, one drifts at 0.5 m/s",
            Lie::Drift(0.5),
            "wrong for 2.8 s",
        ),
        row(
            "two receivers, one drifts at 5 cm/s",
            Lie::Drift(0.05),
            "3.8 % end wrong, 31 of 600 follow",
        ),
    ]
}

/// A quarter of an hour of each robot.
pub(super) fn honest() -> Vec<Experiment> {
    let row = |name, robots, sensors, drive, bars: Vec<Bar>, document: &str| Experiment {
        sensors,
        drive,
        watched_s: 1000.0,
        to_the_end: true,
        beyond: bars.is_empty(),
        bars,
        document: document.into(),
        ..Experiment::new(name, robots)
    };
    let (wander, slowly) = (Drive::Wander(1.0), Drive::Wander(0.2));
    let (fix, exact, neighbour) = (Sensor::fix(0.3), Sensor::fix(0.02), Sensor::neighbour());
    let few = || vec![Bar::Alarms(5)];
    let heavy = fix.with(Tail::Mixed(0.05, 5.0));
    vec![
        row("σ 0.3 m, 10⁶ s", 1000, vec![fix], wander, few(), "1 alarm"),
        row("σ 2 cm, 10⁵ s", 100, vec![exact], wander, few(), ""),
        row(
            "σ 2 cm, stop and go",
            100,
            vec![exact],
            Drive::StopAndGo,
            few(),
            "1 in 6·10⁵ s",
        ),
        row(
            "σ 0.3 m, 0.2 m/s",
            100,
            vec![fix],
            slowly,
            few(),
            "0 in 6·10⁵ s",
        ),
        row("σ 0.3 m, parked", 100, vec![fix], Drive::Parked, few(), ""),
        row(
            "a receiver and two neighbours",
            100,
            vec![fix, neighbour, neighbour],
            wander,
            few(),
            "0 in 4·10⁵ s",
        ),
        row(
            "slow receiver",
            100,
            vec![Sensor::slow()],
            wander,
            few(),
            "ok throughout",
        ),
        row(
            "slow receiver, parked",
            100,
            vec![Sensor::slow()],
            Drive::Parked,
            few(),
            "ok throughout",
        ),
        row(
            "5 % of the fixes five times as wrong",
            100,
            vec![heavy],
            wander,
            vec![],
            "",
        ),
        row(
            "fixes of Student's t₄",
            100,
            vec![fix.with(Tail::Student)],
            wander,
            vec![],
            "",
        ),
    ]
}
