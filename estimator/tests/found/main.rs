//! The vectors `found`: unknown starts, kidnapped robots, outages, liars.

#![allow(clippy::unwrap_used, clippy::cast_precision_loss)] // A test's panic is its verdict; few are counted.

mod case;
mod run;
#[path = "../support/mod.rs"]
mod support;

use case::Case;
use coloc_estimator::FindingState;
use nalgebra::Vector3;
use run::{Delivery, Published, run, source};

/// χ²₃ at 1e-6, 1 % and 0.1 %.
const WRONG: f64 = 30.66;
const PERCENT: f64 = 11.345;
const PER_MILLE: f64 = 16.27;

fn nees(published: &Published, truth: &[f64; 4]) -> f64 {
    let turned = coloc_estimator::angle::wrap(published.pose.phi - truth[3]);
    let apart = Vector3::new(
        published.pose.x - truth[1],
        published.pose.y - truth[2],
        turned,
    );
    let covariance = published.covariance.matrix();
    let solved = covariance.cholesky().map(|it| it.solve(&apart));
    solved.map_or(f64::INFINITY, |solved| apart.dot(&solved))
}

fn is_ok(published: &Published) -> bool {
    published.state == FindingState::Ok
}

fn within(published: &[Published], [from, to]: [f64; 2]) -> impl Iterator<Item = &Published> {
    let is_within = move |it: &&Published| it.t_s >= from - 1e-9 && it.t_s <= to + 1e-9;
    published.iter().filter(is_within)
}

/// What of a case's expectations does not hold, and the NEES of what counts for all files together.
fn judge(case: &Case, published: &[Published]) -> (Vec<String>, Vec<f64>) {
    let mut failed = Vec::new();
    let mut check = |holds: bool, what: String| {
        if !holds {
            failed.push(what);
        }
    };
    let expect = &case.expect;
    let end = case.truth.last().map_or(0.0, |last| last[0]);
    if let Some(by) = expect.found_by_s {
        let ticks: Vec<_> = within(published, [by, end]).collect();
        let ok = ticks.iter().filter(|it| is_ok(it)).count();
        check(
            100 * ok >= 99 * ticks.len(),
            format!("found by {by}: ok in {ok} of {}", ticks.len()),
        );
    }
    if let Some(by) = expect.noticed_by_s {
        let noticed = within(published, [case.event_s, by]).any(|it| !is_ok(it));
        check(noticed, format!("noticed by {by}"));
    }
    for span in &expect.never_ok {
        let ok = within(published, *span).find(|it| is_ok(it));
        check(
            ok.is_none(),
            format!("never ok in {span:?}: ok at {:?}", ok.map(|it| it.t_s)),
        );
    }
    for span in &expect.ok_throughout {
        let not = within(published, *span).find(|it| !is_ok(it));
        check(
            not.is_none(),
            format!("ok throughout {span:?}: not at {:?}", not.map(|it| it.t_s)),
        );
    }
    let mut counted = Vec::new();
    for truth in &case.truth {
        let Some(at) = within(published, [truth[0]; 2]).next() else {
            continue;
        };
        let nees = nees(at, truth);
        let after = |limit: Option<f64>| limit.is_some_and(|limit| truth[0] > limit);
        if after(expect.never_ok_wrong_after_s) && is_ok(at) {
            check(nees <= WRONG, format!("ok and wrong at {}: {nees}", at.t_s));
        }
        if after(expect.covered_after_s) {
            check(
                nees <= WRONG,
                format!("not covered at {}: {nees} {:?}", at.t_s, at.state),
            );
        }
        if after(expect.found_by_s) && is_ok(at) {
            counted.push(nees);
        }
    }
    if let Some(named) = &expect.named {
        let mut named: Vec<_> = named.iter().map(|id| source(case, id)).collect();
        named.sort();
        let mut said = published.last().map_or(Vec::new(), |it| it.named.clone());
        said.sort();
        check(said == named, format!("named: {said:?}"));
    }
    (failed, counted)
}

fn cases() -> Option<Vec<(String, Case)>> {
    let files = support::files_in("found")?;
    let read = |name: String| {
        let case = support::read_vectors(&format!("found/{name}")).unwrap();
        (name, case)
    };
    Some(files.into_iter().map(read).collect())
}

#[test]
fn every_expectation_holds() {
    let Some(cases) = cases() else {
        return;
    };
    let (mut failed, mut counted) = (Vec::new(), Vec::new());
    for (name, case) in &cases {
        let published = run(case, Delivery::InTime);
        if std::env::var_os("COLOC_SHOW").is_some() {
            show(name, case, &published);
        }
        let (said, nees) = judge(case, &published);
        failed.extend(said.into_iter().map(|it| format!("{name}: {it}")));
        counted.extend(nees);
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
    let count = counted.len() as f64;
    let above = |limit| counted.iter().filter(|it| **it > limit).count() as f64 / count;
    let mean = counted.iter().sum::<f64>() / count;
    println!(
        "{count} samples: mean {mean:.2}, above 11.345 {:.4}, above 16.27 {:.4}",
        above(PERCENT),
        above(PER_MILLE)
    );
    assert!(above(PERCENT) <= 0.04 && above(PER_MILLE) <= 0.01 && mean <= 3.6);
}

fn show(name: &str, case: &Case, published: &[Published]) {
    println!("== {name} {}", case.event_s);
    let mut last = None;
    for it in published {
        for decision in &it.decisions {
            println!("   {:.2} {decision:?}", it.t_s);
        }
        if last != Some(it.state) {
            println!("   {:.2} {:?} {:?}", it.t_s, it.state, it.named);
            last = Some(it.state);
        }
    }
}

#[test]
fn any_order_of_delivery_and_duplicates_give_the_same_bits() {
    let Some(cases) = cases() else {
        return;
    };
    for (name, case) in &cases {
        let in_time = run(case, Delivery::InTime);
        for seed in 1..4 {
            let shuffled = run(case, Delivery::Shuffled(seed));
            let decided = |run: &[Published]| -> Vec<_> {
                run.iter()
                    .map(|it| (it.state, it.named.clone(), it.decisions.clone()))
                    .collect()
            };
            let [told, retold] = [&in_time, &shuffled].map(|it| format!("{:?}", decided(it)));
            assert!(told == retold, "{name}, seed {seed}: decisions");
            let [end, other] = [&in_time, &shuffled].map(|it| it.last().unwrap());
            assert_eq!(end.pose, other.pose, "{name}, seed {seed}");
            assert_eq!(end.covariance, other.covariance, "{name}, seed {seed}");
        }
    }
}
