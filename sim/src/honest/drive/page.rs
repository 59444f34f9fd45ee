//! What is said of it.

use super::{Cell, LOOKS_S, Look, World, cells};
use crate::campaign::Finding;
use crate::honest::Form;
use crate::honest::filter::Filter;
use crate::honest::score::Score;
use crate::honest::sort::Sort;
use crate::honest::table::{Table, digits, percent};
use crate::honest::turning::Turning;

/// A filter beyond this has lost its robots.
const LOST: f64 = 100.0;

/// Runs it and holds it to its bar.
#[must_use]
pub fn find(form: &Form) -> Finding {
    let cells = cells(form);
    let text = format!(
        "{}\n{}\n{}",
        examples(&cells),
        worlds_table(&cells),
        at_the_end(&cells)
    );
    Finding {
        title: format!(
            "Half an hour without a fix: {} cells of {} robots, {} Hz",
            cells.len(),
            form.robots,
            form.rate_hz
        ),
        text,
        missed: cells.iter().flat_map(missed).collect(),
    }
}

pub(super) fn missed(cell: &Cell) -> Vec<String> {
    let World { sort, turning } = cell.world;
    let looks = LOOKS_S.into_iter().zip(&cell.looks);
    looks
        .filter(|(_, look)| !look.own().is_honest())
        .map(|(seconds, look)| {
            let own = look.own();
            format!(
                "noise {}, turning {}, heading {:.2} rad at the start, {seconds} s: mean NEES {:.3} ± {:.3}, {} outside",
                sort.name(),
                turning.name(),
                cell.start,
                own.nees(),
                own.standard_error(),
                percent(own.outside())
            )
        })
        .collect()
}

/// The rows of the table that says what the matter was.
fn examples(cells: &[Cell]) -> String {
    let rows = [
        (Sort::Paper, 0.0, 30),
        (Sort::Paper, 0.0, 90),
        (Sort::Paper, 0.0, 600),
        (Sort::Paper, 0.0, 1800),
        (Sort::Sane, 0.0, 600),
        (Sort::Sane, 0.0, 1800),
        (Sort::Sane, 0.3, 90),
    ];
    let [a, b, c, d] = Filter::ALL.map(Filter::name);
    let mut table = Table::new(["straight on, 1 m/s", "σ of the heading then", a, b, c, d]);
    for (sort, start, seconds) in rows {
        let Some(look) = find_look(cells, sort, start, seconds) else {
            continue;
        };
        let [a, b, c, d] = look
            .scores
            .map(|it| format!("{} / {}", digits(it.nees()), percent(it.outside())));
        table.row([
            example_name(sort, start, seconds),
            format!("{:.2} rad", look.heading),
            a,
            b,
            c,
            d,
        ]);
    }
    format!(
        "Mean NEES / share outside of the ellipse for 95 %:\n\n{}",
        table.text()
    )
}

fn example_name(sort: Sort, start: f64, seconds: u32) -> String {
    let begun = if start > 0.0 {
        format!(", heading known to {start} rad before")
    } else {
        String::new()
    };
    format!("{seconds} s, noise {}{begun}", sort.name())
}

fn find_look(cells: &[Cell], sort: Sort, start: f64, seconds: u32) -> Option<&Look> {
    let world = World {
        sort,
        turning: Turning::Steady(0.0),
    };
    let cell = cells
        .iter()
        .find(|it| it.world == world && (it.start - start).abs() < 1e-9)?;
    let index = LOOKS_S.iter().position(|&it| it == seconds)?;
    Some(&cell.looks[index])
}

/// A row for each world: the estimator's extremes over all starts and looks.
fn worlds_table(cells: &[Cell]) -> String {
    let mut table = Table::new(["noise", "turning", "mean NEES", "outside", "honest"]);
    for cells in cells.chunk_by(|a, b| a.world == b.world) {
        let World { sort, turning } = cells[0].world;
        let own = || cells.iter().flat_map(|cell| &cell.looks).map(Look::own);
        let [low, high] = extremes(own().map(Score::nees));
        let [least, most] = extremes(own().map(Score::outside));
        let honest = cells.iter().filter(|cell| is_honest(cell)).count();
        table.row([
            sort.name().into(),
            turning.name(),
            format!("{low:.2} … {high:.2}"),
            format!("{} … {}", percent(least), percent(most)),
            format!("{honest} of {} cells", cells.len()),
        ]);
    }
    format!(
        "coloc, over headings known to 0, 0.02, 0.3, 1, 1.8 and π rad at the start, after 30, 90, 600 and 1,800 s:\n\n{}",
        table.text()
    )
}

fn is_honest(cell: &Cell) -> bool {
    cell.looks.iter().all(|look| look.own().is_honest())
}

fn extremes(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], it| {
        [low.min(it), high.max(it)]
    })
}

/// How many cells each filter gets right after half an hour.
fn at_the_end(cells: &[Cell]) -> String {
    let last: Vec<_> = cells
        .iter()
        .map(|cell| cell.looks[LOOKS_S.len() - 1])
        .collect();
    let mut table = Table::new(["after 1,800 s", "mean NEES within 2 ± 0.25", "above 100"]);
    for (index, filter) in Filter::ALL.into_iter().enumerate() {
        let nees = || last.iter().map(|look| look.scores[index].nees());
        let close = nees().filter(|it| (it - 2.0).abs() <= 0.25).count();
        let lost = nees().filter(|it| *it > LOST).count();
        let of = last.len();
        table.row([
            filter.name().into(),
            format!("{close} of {of} cells"),
            lost.to_string(),
        ]);
    }
    table.text()
}
