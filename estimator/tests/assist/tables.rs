//! The thesis's tables 4.1 to 4.3, which nothing is random in, as they are in `docs/leaders.md`.

use std::fmt::Write;

use coloc_estimator::assist::team::Team;
use coloc_estimator::assist::tree::Graph;
use coloc_estimator::assist::wait::{Bound, Wait};

use crate::distributed::around;
use crate::sync::{Lost, Order, Run};
use crate::trees::{graph_of, place, team_of};

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/leaders.md");
const BEGIN: &str = "<!-- deterministic -->\n";
const END: &str = "<!-- end of deterministic -->";

/// Figure 4.4, who sees and hears whom: 1 to 4 are children, 21 and 22 lead.
const FIGURE_4_4: [[u16; 2]; 6] = [[21, 1], [22, 4], [1, 2], [1, 4], [4, 3], [2, 3]];

/// Figure 4.18, by what table 4.3 says of it.
const FIGURE_4_18: [[u16; 2]; 15] = [
    [21, 2],
    [22, 3],
    [2, 1],
    [2, 3],
    [2, 5],
    [3, 6],
    [1, 4],
    [4, 5],
    [5, 8],
    [6, 7],
    [6, 9],
    [8, 9],
    [8, 10],
    [10, 12],
    [12, 11],
];

/// Table 4.3 as it is printed, but for the neighbours of c9: 3 of them fit neither its own delay nor the others' counts.
const TABLE_4_3: [(&str, [usize; 13]); 8] = [
    ("neighbours", [2, 4, 3, 2, 3, 3, 1, 3, 2, 2, 1, 2, 0]),
    (
        "children among them",
        [2, 3, 2, 2, 3, 3, 1, 3, 2, 2, 1, 2, 0],
    ),
    (
        "longest delay expected",
        [11, 10, 11, 11, 10, 10, 12, 10, 11, 11, 12, 11, 0],
    ),
    ("poses expected", [2, 2, 2, 2, 2, 2, 1, 2, 2, 2, 1, 2, 0]),
    ("poses received", [2, 2, 2, 2, 2, 2, 1, 2, 2, 1, 1, 1, 0]),
    (
        "memory cleared after",
        [7, 2, 2, 6, 5, 5, 3, 4, 4, 11, 6, 11, 0],
    ),
    ("sightings from l1", [2, 1, 2, 3, 2, 5, 0, 3, 4, 4, 6, 5, 0]),
    ("sightings from l2", [7, 2, 1, 6, 5, 2, 3, 4, 3, 0, 0, 0, 0]),
];

fn figure(children: u16, sides: &[[u16; 2]]) -> (Team, Graph) {
    let children: Vec<_> = (1..=children).collect();
    let team = team_of(&[21, 22], &children);
    let back = sides.iter().map(|[a, b]| [*b, *a]);
    let sees: Vec<_> = sides.iter().copied().chain(back).collect();
    let graph = graph_of(&team, &sees);
    (team, graph)
}

fn run((team, graph): &(Team, Graph)) -> Run<'_> {
    Run::new(team, graph, &[21, 22], Order::Fifo, Lost::default())
}

fn named(robot: u16) -> String {
    match robot {
        1..=20 => format!("c{robot}"),
        _ => format!("l{}", robot - 20),
    }
}

/// Every message, and what becomes of it.
fn tables_4_1_and_4_2() -> String {
    let figure = figure(4, &FIGURE_4_4);
    let mut page = "| step | from | to | way | |\n| --- | --- | --- | --- | --- |\n".to_owned();
    for (tick, from, to, _, path, result, _) in &run(&figure).messages {
        let way: Vec<_> = path.iter().map(|it| named(*it)).collect();
        let became = match result.as_str() {
            "accept" => "taken",
            _ => "declined: it is not in the thesis's tables, its algorithm sends it",
        };
        let ends = [from, to].map(|it| named(*it));
        let [from, to] = ends;
        let row = format!(
            "| {} | {from} | {to} | {} | {became} |",
            tick + 1,
            way.join(" ")
        );
        writeln!(page, "{row}").unwrap();
    }
    page
}

/// In the order of [`TABLE_4_3`].
fn column((team, graph): &(Team, Graph), run: &Run<'_>, child: u16) -> [usize; 8] {
    let around = around(team, graph, place(team, child));
    let got: Vec<_> = run.got.iter().filter(|it| it.0 == child).collect();
    let degree = |leader| got.iter().find(|it| it.1 == leader).map_or(0, |it| it.3);
    let wait = Wait::new(&around, Bound::Own);
    let expected = wait.as_ref().map_or(0, Wait::most);
    let delay = wait.map_or(0, |it| usize::try_from(it.max_delay()).unwrap());
    let last = degree(21).max(degree(22));
    let cleared = if got.len() < expected { delay } else { last };
    [
        around.seen,
        around.seen_children,
        delay,
        expected,
        got.len(),
        cleared,
        degree(21),
        degree(22),
    ]
}

fn table_4_3() -> String {
    let figure = figure(13, &FIGURE_4_18);
    let run = run(&figure);
    let columns: Vec<_> = (1..=13).map(|child| column(&figure, &run, child)).collect();
    let names: Vec<_> = (1..=13).map(named).collect();
    let mut page = format!(
        "| | {} |\n| ---{} |\n",
        names.join(" | "),
        " | ---".repeat(13)
    );
    for (row, (name, printed)) in TABLE_4_3.iter().enumerate() {
        let ours: Vec<_> = columns.iter().map(|it| it[row]).collect();
        assert_eq!(ours, printed, "{name}");
        let cells: Vec<_> = ours.iter().map(ToString::to_string).collect();
        writeln!(page, "| {name} | {} |", cells.join(" | ")).unwrap();
    }
    let taken = run.messages.iter().filter(|it| it.5 == "accept").count();
    let count = run.messages.len();
    assert_eq!((count, taken), (25, 20));
    writeln!(page, "\n{count} data, {taken} of them taken.").unwrap();
    page
}

fn section() -> String {
    format!(
        "Tables 4.1 and 4.2, of figure 4.4 (l1–c1, l2–c4, c1–c2, c1–c4, c4–c3, c2–c3):\n\n{}\nTable 4.3, of figure 4.18, every \
         number as printed but for the neighbours of c9 (3 there):\n\n{}",
        tables_4_1_and_4_2(),
        table_4_3()
    )
}

#[test]
fn the_page_shows_the_tables_that_nothing_is_random_in() {
    let page = std::fs::read_to_string(PAGE).unwrap();
    let (before, rest) = page.split_once(BEGIN).expect("where they begin");
    let (_, after) = rest.split_once(END).expect("where they end");
    let current = format!("{before}{BEGIN}{}{END}{after}", section());
    if std::env::var_os("COLOC_WRITE").is_some() {
        std::fs::write(PAGE, current).unwrap();
    } else {
        assert!(
            page == current,
            "docs/leaders.md shows others: `COLOC_WRITE=1 cargo test -p coloc-estimator --test assist` writes them anew"
        );
    }
}
