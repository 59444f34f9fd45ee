//! `coloc eval --robots`: what a robot costs, and how that grows with how many there are.

mod cost;
mod outputs;

use coloc_sim::scale::{Network, ScaleConfig, ScaleReport, run as simulate};

use self::cost::Cost;
use self::outputs::Outputs;
use super::EvalCommandError;
use super::args::EvalArgs;
use super::number::{cm, digits, percent};
use super::progress::Bar;
use super::run::start_threads;
use super::table::Table;
use crate::output::{print_line, takes_no_more};

/// Of the world's time, where nothing else is said \[s\].
const SECONDS: f64 = 600.0;

/// What was found of so many robots, and what it took.
struct Found {
    report: ScaleReport,
    cost: Cost,
}

pub(super) fn run(args: &EvalArgs) -> Result<(), EvalCommandError> {
    let outputs = Outputs::prepare(args)?;
    start_threads(args)?;
    let mut found = Vec::new();
    for config in configs(args) {
        if takes_no_more() && !outputs.any() {
            return Ok(());
        }
        let bar = Bar::new(&format!("{} robots", config.robots));
        let (report, cost) = cost::of(|| simulate(&config, &|progress| bar.show(progress)));
        drop(bar);
        found.push(Found { report, cost });
    }
    print_line(&format!("{}\n", heading(args)));
    for table in tables(&found) {
        print_line(&table.text());
    }
    print_line(&messages(&found).text());
    outputs.write(&found)
}

/// The fewest first: memory that was used once is not given back in any order.
fn configs(args: &EvalArgs) -> Vec<ScaleConfig> {
    let mut robots = args.robots.clone();
    robots.sort_unstable();
    robots.dedup();
    let config = |robots: u32| ScaleConfig {
        robots: robots as usize,
        seconds: args.seconds.unwrap_or(SECONDS),
        seed: args.seed,
        neighbours: args.neighbours,
        network: Network {
            loss: args.loss,
            delay_s: 1e-3 * args.delay_ms,
        },
    };
    robots.into_iter().map(config).collect()
}

fn heading(args: &EvalArgs) -> String {
    format!(
        "synthetic field: {:.0} s, 50 ticks and 10 exchanges a second, {} threads, seed {}",
        args.seconds.unwrap_or(SECONDS),
        rayon::current_num_threads(),
        args.seed
    )
}

fn tables(found: &[Found]) -> Vec<Table> {
    vec![costs(found), accuracy(found)]
}

fn costs(found: &[Found]) -> Table {
    let mut table = Table::new(
        "Cost: all of the program's processor time, of the world too; a robot for a tick of 20 ms; memory at its peak",
        &[
            "robots",
            "digest",
            "time [s]",
            "CPU [s]",
            "CPU [ns per robot and tick]",
            "memory [MiB]",
            "memory [kB per robot]",
        ],
    );
    for Found { report, cost } in found {
        table.rows.push(vec![
            report.robots.to_string(),
            report.digest.clone(),
            digits(cost.wall_s),
            digits(cost.cpu_s),
            format!("{:.0}", cost.ns_per(report.robot_ticks())),
            cost.peak_mib
                .map_or_else(|| "–".into(), |mib| format!("{mib:.0}")),
            kilobytes(report.bytes_per_robot),
        ]);
    }
    table
}

fn accuracy(found: &[Found]) -> Table {
    let mut table = Table::new(
        "Accuracy of all robots together: NEES (nominal 3; 5 % above its 95 % bound, 7.81)",
        &[
            "robots",
            "receivers",
            "field [m]",
            "in range",
            "messages",
            "gated [%]",
            "RMS position [cm]",
            "RMS heading [rad]",
            "NEES",
            "outside [%]",
            "unsure [%]",
            "refused",
        ],
    );
    for Found { report, .. } in found {
        table.rows.push(vec![
            report.robots.to_string(),
            report.receivers.to_string(),
            format!("{:.0}", report.field_m),
            digits(report.neighbours),
            report.messages.to_string(),
            report
                .gated_share
                .map_or_else(|| "–".into(), |share| format!("{:.3}", 100.0 * share)),
            cm(report.rms_position_m),
            super::number::rad(report.rms_heading_rad),
            digits(report.nees),
            percent(report.outside),
            percent(report.unsure),
            report.refused.to_string(),
        ]);
    }
    table
}

/// Of a `neighbour` on the air, with the link's envelope and signature, QUIC, UDP and IP (`docs/fleet.md`) \[bytes\].
const ON_THE_AIR: f64 = 384.0;

#[allow(clippy::cast_precision_loss)] // Counts are far below 2^53.
fn messages(found: &[Found]) -> Table {
    let mut table = Table::new(
        "Messages of a robot, as over links: each is signed once and checked once",
        &[
            "robots",
            "in range",
            "said [1/s]",
            "lost [%]",
            "heard and checked [1/s]",
            "on the air [kB/s]",
            "RMS position [cm]",
            "NEES",
            "outside [%]",
        ],
    );
    for Found { report, .. } in found {
        let seconds = report.robot_ticks() as f64 / 50.0;
        let [heard, lost] = [report.messages, report.lost].map(|it| it as f64 / seconds);
        let said = heard + lost;
        table.rows.push(vec![
            report.robots.to_string(),
            digits(report.neighbours),
            digits(said),
            percent(lost / said),
            digits(heard),
            digits(1e-3 * said * ON_THE_AIR),
            cm(report.rms_position_m),
            digits(report.nees),
            percent(report.outside),
        ]);
    }
    table
}

#[allow(clippy::cast_precision_loss)] // Some thousand bytes.
fn kilobytes(bytes: usize) -> String {
    format!("{:.1}", bytes as f64 / 1e3)
}
