//! How the robots of a row see and tell, and what an independent implementation made of it.

/// How the cameras err: of the range relative and beside it, and of the bearing; then what is slow of it.
#[derive(Copy, Clone, Debug)]
pub(super) struct Camera {
    pub(super) relative: f64,
    pub(super) beside_m: f64,
    pub(super) bearing: f64,
    pub(super) slow: [f64; 2],
}

/// As the cameras of MR.CLAM do.
const SPLIT: Camera = Camera {
    relative: 0.006,
    beside_m: 0.005,
    bearing: 0.006,
    slow: [0.045, 0.013],
};

/// Who learns of a sighting of another robot.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) enum Ways {
    /// Nobody.
    None,
    /// The robot that was seen.
    Told,
    /// The one that saw it too.
    Both,
    /// The robot that was seen, by a relative pose whose heading nobody knows: as if there were no sightings in part.
    Poses,
}

/// What is used of a sighting.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) enum Numbers {
    Both,
    Bearing,
    Range,
}

/// The same errors, taken as new in every sighting.
const WHITE: Camera = Camera {
    relative: 0.045,
    beside_m: 0.005,
    bearing: 0.014,
    slow: [0.0; 2],
};

/// Of each recording, of the robots without a receiver, x and y \[cm\].
pub(super) type Reference = [&'static [[f64; 2]]; 2];

/// A row of the table.
#[derive(Copy, Clone, Debug)]
pub(super) struct Method {
    pub(super) name: &'static str,
    pub(super) ways: Ways,
    pub(super) landmarks: bool,
    pub(super) receivers: usize,
    /// Those without a receiver do not know at the start which way they look.
    pub(super) lost: bool,
    pub(super) camera: Camera,
    pub(super) numbers: Numbers,
    /// Poses of tracks take the place of sightings, where there are any.
    pub(super) tracks: bool,
    pub(super) idea: Idea,
    /// Of each recording, of R1 to R5, x and y \[cm\]; those with a receiver have none.
    pub(super) reference: Reference,
}

/// What is done to the sightings first; by default nothing.
#[derive(Copy, Clone, Debug)]
pub(super) struct Idea {
    /// They are so much later than they are taken to be \[s\].
    pub(super) later_s: f64,
    /// Of each recording, of R1 to R5: their cameras' bearings are off by so much \[rad\], and it is taken off.
    pub(super) turned_rad: [[f64; 5]; 2],
    /// The slow errors are forgotten in so long \[s\]: what is new of them since the camera's last image is independent. Infinite: never.
    pub(super) forgets_s: f64,
    /// Of each recording, of R1 to R5: what the wheels say of a way is multiplied by this.
    pub(super) ways: [[f64; 5]; 2],
    /// The wheels' noise of a turn, as a part of what it is otherwise.
    pub(super) turning: f64,
}

/// Nothing.
pub(super) const AS_IT_IS: Idea = Idea {
    later_s: 0.0,
    turned_rad: [[0.0; 5]; 2],
    forgets_s: f64::INFINITY,
    ways: [[1.0; 5]; 2],
    turning: 1.0,
};

/// No bar.
pub(super) const FREE: Reference = [&[], &[]];

pub(super) const TWO_RECEIVERS: Reference = [
    &[[15.9, 18.9], [14.3, 13.4], [13.7, 10.9]],
    &[[12.2, 12.5], [12.7, 12.9], [9.9, 11.1]],
];
pub(super) const ONE_RECEIVER: Reference = [
    &[[22.1, 29.0], [19.2, 21.6], [16.7, 19.3], [21.0, 21.2]],
    &[[20.2, 21.5], [12.9, 16.8], [18.3, 17.5], [19.6, 19.5]],
];
pub(super) const WITH_LANDMARKS: Reference = [
    &[[5.5, 6.1], [7.6, 7.2], [5.2, 6.2]],
    &[[7.3, 8.0], [6.1, 9.8], [4.9, 7.0]],
];

/// With two receivers, everything used.
pub(super) const BOTH_WAYS: Method = Method {
    name: "",
    ways: Ways::Both,
    landmarks: false,
    receivers: 2,
    lost: false,
    camera: SPLIT,
    numbers: Numbers::Both,
    tracks: false,
    idea: AS_IT_IS,
    reference: FREE,
};

/// The rows.
pub(super) const METHODS: [Method; 10] = [
    Method {
        name: "alone",
        ways: Ways::None,
        ..BOTH_WAYS
    },
    Method {
        name: "only told where one was seen",
        ways: Ways::Told,
        ..BOTH_WAYS
    },
    Method {
        name: "both ways",
        reference: TWO_RECEIVERS,
        ..BOTH_WAYS
    },
    Method {
        name: "both ways, one receiver",
        receivers: 1,
        reference: ONE_RECEIVER,
        ..BOTH_WAYS
    },
    Method {
        name: "both ways, headings unknown at the start",
        lost: true,
        reference: TWO_RECEIVERS,
        ..BOTH_WAYS
    },
    Method {
        name: "both ways, one receiver, headings unknown at the start",
        receivers: 1,
        lost: true,
        reference: ONE_RECEIVER,
        ..BOTH_WAYS
    },
    Method {
        name: "both ways, and 15 landmarks",
        landmarks: true,
        reference: WITH_LANDMARKS,
        ..BOTH_WAYS
    },
    Method {
        name: "both ways, all noise taken as white",
        camera: WHITE,
        ..BOTH_WAYS
    },
    Method {
        name: "both ways, bearings alone",
        numbers: Numbers::Bearing,
        ..BOTH_WAYS
    },
    Method {
        name: "both ways, ranges alone",
        numbers: Numbers::Range,
        ..BOTH_WAYS
    },
];

/// Without tracks, and with.
pub(super) const FED: [Method; 2] = [
    Method {
        name: "both ways",
        reference: TWO_RECEIVERS,
        ..BOTH_WAYS
    },
    FED_BY_TRACKS,
];

/// With two receivers; poses of tracks in the place of sightings.
pub(super) const FED_BY_TRACKS: Method = Method {
    name: "both ways, fed by coloc-track",
    tracks: true,
    reference: TWO_RECEIVERS,
    ..BOTH_WAYS
};
