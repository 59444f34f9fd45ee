//! `docs/channels.md` shows the table of channels.
//!
//! `COLOC_WRITE=1 cargo test -p coloc-shm-types --test channels` writes it anew.
use coloc_shm_types::{Age, Audience, Channel, Matters, Speaker, Told};

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/channels.md");
const BEGIN: &str = "<!-- table -->\n";
const END: &str = "<!-- end of table -->";

fn table() -> String {
    let head = "| channel | what | from | to | of use for | of them | who joins late | bytes | places | waits |\n\
                | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n";
    Channel::TABLE
        .iter()
        .map(row)
        .fold(head.into(), |table, row| table + &row)
}

fn row(told: &Told) -> String {
    let by = match told.by {
        Speaker::Drivers => "drivers",
        Speaker::Own => "`colocd`",
        Speaker::Neighbours => "other robots' `colocd`",
        Speaker::Tracker => "`coloc-track`",
        Speaker::Trackers => "other robots' `coloc-track`",
        Speaker::Bounds => "`coloc-bounds`",
        Speaker::Rounds => "`coloc-rounds`",
    };
    let to = match told.to {
        Audience::Robot => "`colocd`",
        Audience::Anyone => "anyone",
    };
    let age = match told.age {
        Age::History => "the history".into(),
        Age::Millis(millis) => format!("{} s", f64::from(millis) / 1000.0),
    };
    let matters = match told.matters {
        Matters::All => "all",
        Matters::Newest => "the newest",
    };
    let late = if told.late_joiner {
        "gets the last one"
    } else {
        "–"
    };
    format!(
        "| `{}` | {} | {by} | {to} | {age} | {matters} | {late} | {} | {} + {} | {} |\n",
        told.name, told.what, told.size, told.publishers, told.subscribers, told.buffer
    )
}

/// The page with the table as it is now.
fn filled_in(page: &str) -> String {
    let (before, rest) = page.split_once(BEGIN).expect("where the table begins");
    let (_, after) = rest.split_once(END).expect("where the table ends");
    format!("{before}{BEGIN}{}{END}{after}", table())
}

#[test]
fn the_page_shows_the_table() {
    let page = std::fs::read_to_string(PAGE).unwrap();
    let current = filled_in(&page);
    if std::env::var_os("COLOC_WRITE").is_some() {
        std::fs::write(PAGE, current).unwrap();
    } else {
        assert!(
            page == current,
            "docs/channels.md shows an older table: \
             `COLOC_WRITE=1 cargo test -p coloc-shm-types --test channels` writes it anew"
        );
    }
}
