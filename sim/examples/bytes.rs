//! How accurate robots are by how much they say: the table and the picture of `docs/fleet.md`.
//!
//! ```text
//! cargo run --release -p coloc-sim --example bytes -- ../shared/data/mrclam1 5 docs/fleet/bytes.svg
//! ```
//!
//! Sightings, with a message each, and rounds come so often a second; nothing else changes. Bytes are those on the air: of a message's
//! numbers, of the link's envelope and signature (116), of QUIC, UDP and IP (60).

use std::error::Error;
use std::fmt::Write as _;
use std::io::{Write as _, stdout};
use std::path::Path;
use std::sync::Arc;

use coloc_sim::Scenario;
use coloc_sim::evaluate::{EvalConfig, EvalWorld, MethodReport, evaluate};
use coloc_sim::method::{FilterSettings, Kind};
use coloc_sim::mrclam::Recording;

const RATES_HZ: [f64; 4] = [10.0, 2.0, 0.5, 0.1];
const METHODS: [Kind; 4] = [Kind::Sl, Kind::SplitCi, Kind::Coloc, Kind::Rounds];
/// Around the numbers of a message (bytes).
const AROUND: f64 = 116.0 + 60.0;

/// One method at one rate.
struct Row {
    method: Kind,
    rate_hz: f64,
    messages_per_s: f64,
    bytes_per_s: f64,
    rms_m: f64,
    last_rms_m: f64,
    outside: f64,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, runs, picture, seconds @ ..] = arguments.as_slice() else {
        return Err("usage: FOLDER RUNS PICTURE [SECONDS]".into());
    };
    let world = Recording::load(Path::new(folder))?.resample();
    let mut config = EvalConfig::new(EvalWorld::Recorded(Arc::new(world)));
    config.runs = runs.parse()?;
    config.seconds = seconds.first().map(|it| it.parse()).transpose()?;
    config.methods = METHODS.to_vec();
    let mut rows = Vec::new();
    let mut out = stdout();
    writeln!(
        out,
        "| | a second | messages/s | kB/s on the air | RMS position, mean [cm] | of the last robot [cm] | outside [%] |"
    )?;
    writeln!(out, "| --- | --- | --- | --- | --- | --- | --- |")?;
    for rate_hz in RATES_HZ {
        config.scenario = Scenario::named("slip").ok_or("no scenario slip")?;
        config.scenario.sightings.rate_hz = rate_hz;
        config.settings = Some(FilterSettings {
            rounds_hz: Some(rate_hz),
            ..FilterSettings::new(&config.scenario, 0.02)
        });
        let report = evaluate(&config, &|_| ())?;
        let seconds = report.dt_s * f64::from(u32::try_from(report.steps)?);
        for method in &report.methods {
            let row = Row::of(method, rate_hz, seconds);
            writeln!(out, "{}", row.line())?;
            rows.push(row);
        }
    }
    std::fs::write(picture, draw(&rows)?)?;
    Ok(())
}

impl Row {
    #[allow(clippy::cast_precision_loss)] // Counts, far below 2^53.
    fn of(report: &MethodReport, rate_hz: f64, seconds: f64) -> Self {
        let robots = &report.robots;
        let mean = |value: fn(&coloc_sim::evaluate::RobotReport) -> f64| {
            robots.iter().map(value).sum::<f64>() / robots.len() as f64
        };
        let silent = report.method == Kind::Sl;
        let messages_per_s = if silent {
            0.0
        } else {
            report.messages_per_run / seconds
        };
        Self {
            method: report.method,
            rate_hz,
            messages_per_s,
            bytes_per_s: messages_per_s * (report.message_bytes as f64 + AROUND),
            rms_m: mean(|robot| robot.rms_position),
            last_rms_m: robots.last().map_or(f64::NAN, |robot| robot.rms_position),
            outside: mean(|robot| robot.nees_outside),
        }
    }

    fn line(&self) -> String {
        format!(
            "| `{}` | {} | {:.1} | {:.2} | {:.1} | {:.1} | {:.1} |",
            self.method.name(),
            self.rate_hz,
            self.messages_per_s,
            1e-3 * self.bytes_per_s,
            100.0 * self.rms_m,
            100.0 * self.last_rms_m,
            100.0 * self.outside
        )
    }
}

/// Where in the picture: 10 B/s to 100 kB/s, 1 cm to 10 m, both by their logarithms.
fn place(bytes_per_s: f64, rms_m: f64) -> [f64; 2] {
    let [x, y] = [bytes_per_s.log10() - 1.0, 1.0 - rms_m.log10()];
    [110.0 * x + 70.0, 110.0 * y + 30.0]
}

/// Error over bytes, both logarithmic.
fn draw(rows: &[Row]) -> Result<String, std::fmt::Error> {
    let mut svg = String::from(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"660\" height=\"420\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"660\" height=\"420\" fill=\"white\"/>\n",
    );
    for (power, text) in (1..).zip(["10 B/s", "100 B/s", "1 kB/s", "10 kB/s", "100 kB/s"]) {
        let [x, _] = place(10_f64.powi(power), 1.0);
        writeln!(
            svg,
            "<path d=\"M{x} 30V360\" stroke=\"#ddd\"/><text x=\"{x}\" y=\"378\" text-anchor=\"middle\">{text}</text>"
        )?;
    }
    for (power, text) in (-2..).zip(["1 cm", "10 cm", "1 m", "10 m"]) {
        let [_, y] = place(10.0, 10_f64.powi(power));
        writeln!(
            svg,
            "<path d=\"M70 {y}H510\" stroke=\"#ddd\"/><text x=\"62\" y=\"{}\" text-anchor=\"end\">{text}</text>",
            y + 4.0
        )?;
    }
    writeln!(
        svg,
        "<text x=\"290\" y=\"404\" text-anchor=\"middle\">said by the whole team, on the air</text>"
    )?;
    writeln!(
        svg,
        "<text x=\"290\" y=\"18\" text-anchor=\"middle\">RMS position, mean of five robots, by what they say</text>"
    )?;
    let colours = [
        ("#888", Kind::Sl),
        ("#c33", Kind::SplitCi),
        ("#27b", Kind::Coloc),
        ("#2a2", Kind::Rounds),
    ];
    for (line, (colour, method)) in colours.iter().enumerate() {
        let own: Vec<_> = rows.iter().filter(|row| row.method == *method).collect();
        let places = own.iter().zip([1e5, 1e4, 1e2, 1e1]);
        // Who says nothing is as accurate whatever others say: a line across.
        let places = places.map(|(row, across)| match row.method {
            Kind::Sl => place(across, row.rms_m),
            _ => place(row.bytes_per_s, row.rms_m),
        });
        let places: Vec<_> = places.collect();
        let path: Vec<_> = places
            .iter()
            .map(|[x, y]| format!("{x:.1} {y:.1}"))
            .collect();
        writeln!(
            svg,
            "<path d=\"M{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>",
            path.join("L")
        )?;
        for [x, y] in places.iter().filter(|_| *method != Kind::Sl) {
            writeln!(
                svg,
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"{colour}\"/>"
            )?;
        }
        let y = 60 + 22 * line;
        let name = match method {
            Kind::Sl => "alone",
            method => method.name(),
        };
        writeln!(
            svg,
            "<path d=\"M525 {y}h20\" stroke=\"{colour}\" stroke-width=\"2\"/><text x=\"550\" y=\"{}\">{name}</text>",
            y + 4
        )?;
    }
    svg.push_str("</svg>\n");
    Ok(svg)
}
