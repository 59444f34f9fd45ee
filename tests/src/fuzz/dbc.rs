//! DBC files: what is accepted decodes any payload to a value in its range, or to none.

use coloc_drivers::{COLOC_DBC, Database, DbcMessage};

use super::{Target, scratch};

pub(super) const TARGET: Target = Target {
    name: "dbc",
    run,
    samples,
};

/// So many names of messages, and of signals of each, are asked for.
const NAMES: usize = 8;

const PAYLOADS: [[u8; 8]; 4] = [[0; 8], [0xFF; 8], [0x80; 8], [1, 2, 3, 4, 5, 6, 7, 8]];

fn run(bytes: &[u8]) {
    let path = scratch::file("robot.dbc", bytes);
    let Ok(database) = Database::load(Some(&path)) else {
        return;
    };
    let text = String::from_utf8_lossy(bytes);
    for name in after(&text, "BO_", 1) {
        if let Ok(message) = database.message(name) {
            let _ = message.id();
            after(&text, "SG_", 0).for_each(|signal| decode(&database, message, signal));
        }
    }
}

/// The words that come so many words after `keyword`.
fn after<'a>(text: &'a str, keyword: &'a str, skipped: usize) -> impl Iterator<Item = &'a str> {
    let parts = text.split(keyword).skip(1).take(NAMES);
    let words = parts.filter_map(move |part| part.split_whitespace().nth(skipped));
    words.map(|word| word.trim_end_matches(':'))
}

fn decode(database: &Database, message: &DbcMessage, name: &str) {
    let Ok(signal) = database.signal(message, name) else {
        return;
    };
    for payload in PAYLOADS {
        for length in [0, 1, payload.len()] {
            let payload = &payload[..length];
            let value = signal.physical(payload);
            assert_eq!(value.is_some(), signal.raw(payload).is_some(), "{name}");
            if let Some(value) = value {
                assert!(
                    value.is_finite() || !signal.is_integer(),
                    "{name} is {value}"
                );
                let allowed = signal.allows(value) || !is_within(signal.range(), value);
                assert!(allowed, "{name} of {value} is in its range");
            }
        }
    }
}

fn is_within(range: Option<[f64; 2]>, value: f64) -> bool {
    range.is_none_or(|[least, most]| (least..=most).contains(&value))
}

fn samples() -> Vec<Vec<u8>> {
    let car = "\
VERSION \"\"
BS_:
BU_: Car
BO_ 170 WHEEL_SPEEDS: 8 Car
 SG_ FRONT_LEFT : 7|16@0+ (0.01,-67.67) [0|250] \"km/h\" Car
 SG_ MODE M : 16|4@1+ (1,0) [0|15] \"\" Car
 SG_ DEEP m1 : 20|12@1- (0.5,0) [0|0] \"\" Car
BO_ 2566834684 EXTENDED: 8 Car
 SG_ TURN : 0|32@1- (1,0) [-1|1] \"rad/s\" Car
SIG_VALTYPE_ 2566834684 TURN : 1;
VAL_ 170 MODE 0 \"off\" 1 \"on\" ;
BA_DEF_ BO_ \"GenMsgCycleTime\" INT 0 10000;
BA_DEF_DEF_ \"GenMsgCycleTime\" 0;
BA_ \"GenMsgCycleTime\" BO_ 170 20;
CM_ SG_ 170 FRONT_LEFT \"the \\\"left\\\" one\";
";
    vec![COLOC_DBC.into(), car.into()]
}
