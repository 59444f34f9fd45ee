//! The pictures of `docs/leaders.md`: who sees whom and which pose goes where, errors inside 3σ, and NEES.

use std::path::{Path, PathBuf};

use clap::Args;
use coloc_sim::campaign::recordings;
use coloc_sim::leaders::team::picture::{Graph, Moment, Run, Track};
use plotters::prelude::RGBColor;

use crate::output::{complain, print_line};
use crate::pictures::{
    EllipsePanel, ErrorPoint, Line, Panel, Scale, Trace, draw_ellipses, draw_errors, draw_lines,
};
use crate::result_file::WriteError;
use crate::status::Status;

/// Draws the pictures of docs/leaders.md.
#[derive(Clone, Debug, Args)]
pub(crate) struct LeadersArgs {
    /// The folder that gets them, as SVG
    folder: PathBuf,
    /// The folder with recordings; else `COLOC_DATA`, else `shared/data` beside the repository or above
    #[arg(long, value_name = "FOLDER")]
    data: Option<PathBuf>,
    /// Where all chance comes from
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Cases of the thesis.
const CASES: [usize; 4] = [5, 6, 7, 8];
/// Of the events that are shown \[s\].
const TIMES_S: [(f64, &str); 2] = [(60.0, "after 60 s"), (740.0, "after 740 s")];
/// NEES are averaged over so long \[s\].
const WINDOW_S: f64 = 20.0;
/// χ² with three degrees of freedom, 95 %.
const CHI2_3_95: f64 = 7.814_727_903_251_179;
/// The first child, as a place in the team.
const FIRST_CHILD: usize = 1;

const GREY: RGBColor = RGBColor(190, 190, 195);
const TREES: [(&str, RGBColor); 2] = [
    ("tree of leader 1", RGBColor(0, 114, 178)),
    ("tree of leader 3", RGBColor(213, 94, 0)),
];
const METHODS: [RGBColor; 4] = [
    RGBColor(213, 94, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 158, 115),
    RGBColor(60, 60, 70),
];

/// The whole command.
pub(crate) fn command(args: &LeadersArgs) -> Status {
    let data = recordings(args.data.clone());
    let run = data
        .ok_or_else(|| "no recordings: set COLOC_DATA to the folder that holds mrclam1".into())
        .and_then(|data| Run::read(&data, args.seed));
    let drawn = run.and_then(|run| draw(&args.folder, &run).map_err(|error| error.to_string()));
    match drawn {
        Ok(files) => {
            for file in files {
                print_line(&format!("{}", file.display()));
            }
            Status::Done
        }
        Err(error) => {
            complain(&format!("coloc: {error}"));
            Status::Failed
        }
    }
}

fn draw(folder: &Path, run: &Run) -> Result<Vec<PathBuf>, WriteError> {
    let [graphs, errors, nees] =
        ["graphs.svg", "errors.svg", "nees.svg"].map(|name| folder.join(name));
    let panels: Vec<_> = TIMES_S.iter().filter_map(|at| panel(run, *at)).collect();
    let caption = "Who sees whom among MR.CLAM's robots, and the trees by which poses go from leaders to children";
    draw_ellipses(&graphs, caption, &panels)?;
    let tracks = CASES.map(|case| run.tracks(case));
    if let Some(track) = tracks[0].last() {
        let caption = format!(
            "Robot 2, case 5, {}: estimate minus truth, and its ±3σ",
            track.method
        );
        let points = track.moments.iter().map(point).collect();
        draw_errors(&errors, &caption, FIRST_CHILD, &[points])?;
    }
    let panels: Vec<_> = CASES.iter().zip(&tracks).map(of_case).collect();
    let caption = format!("NEES of robot 2, one run, means over {WINDOW_S} s: 3 is honest");
    draw_lines(&nees, &caption, &panels)?;
    Ok(vec![graphs, errors, nees])
}

fn point(moment: &Moment) -> ErrorPoint {
    ErrorPoint {
        time_s: moment.time_s,
        error: moment.error,
        three_sigma: moment.three_sigma,
        knows: true,
    }
}

fn of_case((case, tracks): (&usize, &Vec<Track>)) -> Panel<'static> {
    let line = |(track, color): (&Track, RGBColor)| Line {
        label: track.method.into(),
        color,
        points: means(&track.moments),
    };
    Panel {
        y_axis: format!("NEES, case {case}"),
        scale: Scale::Logarithmic,
        band: Some(([1e-1, CHI2_3_95], "95 % of single ones")),
        lines: tracks.iter().zip(METHODS).map(line).collect(),
    }
}

fn means(moments: &[Moment]) -> Vec<(f64, Option<f64>)> {
    let window = |moment: &Moment| (moment.time_s / WINDOW_S).floor();
    let pieces = moments.chunk_by(|a, b| window(a).total_cmp(&window(b)).is_eq());
    #[allow(clippy::cast_precision_loss)] // Some steps.
    let mean = |piece: &[Moment]| {
        let sum: f64 = piece.iter().map(|it| it.nees).sum();
        let first = piece.first()?;
        Some((first.time_s, Some(sum / piece.len() as f64)))
    };
    pieces.filter_map(mean).collect()
}

/// One event.
fn panel(run: &Run, (time_s, title): (f64, &str)) -> Option<EllipsePanel> {
    let Graph {
        places,
        seen,
        trees,
    } = run.graph(time_s)?;
    let place = |robot: u16| {
        let found = places.iter().find(|(it, _)| *it == robot);
        found.map(|(_, [x, y])| (*x, *y))
    };
    let trace = |[from, to]: [u16; 2], label, color| {
        Some(Trace {
            label,
            color,
            end_label: None,
            points: vec![place(from)?, place(to)?],
        })
    };
    let seen = seen.into_iter().filter_map(|it| trace(it, "sees", GREY));
    let trees = trees.into_iter().zip(TREES);
    let trees = trees.flat_map(|((_, edges), (label, color))| {
        edges.into_iter().map(move |edge| (edge, label, color))
    });
    let trees = trees.filter_map(|(edge, label, color)| trace(edge, label, color));
    let leaders = TREES.iter().zip([1, 3]).filter_map(|((_, color), robot)| {
        Some(Trace {
            label: "leader",
            color: *color,
            end_label: Some("leader"),
            points: vec![place(robot)?],
        })
    });
    Some(EllipsePanel {
        title: title.into(),
        points: places.iter().map(|(_, [x, y])| (*x, *y)).collect(),
        points_label: "robots",
        ellipses: Vec::new(),
        traces: seen.chain(trees).chain(leaders).collect(),
    })
}
