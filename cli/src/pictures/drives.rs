//! Where robots were, where they said they were and how sure they were of it, who saw whom; and for every robot a small panel with
//! the way that its wheels alone would have made of it.

use std::path::Path;

use coloc_estimator::Pose;
use coloc_shm_types::BeliefState;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::ellipses::outline;
use super::legend::{CROSS_PX, Legend, Look, dashed};
use super::style::{GRID, INK, TRUTH, line, robot_color, state_color, thinned, tick_label};
use super::window::{Chart, LABELS_PX, MARGIN_PX, Window};
use super::{Area, Failure, write_svg};
use crate::comparison::Moment;
use crate::result_file::WriteError;

/// One robot's part in the picture.
pub(crate) struct Drive<'a> {
    pub(crate) name: &'a str,
    /// Under its name.
    pub(crate) note: String,
    /// In the order of their stamps; between the pieces there is a gap.
    pub(crate) pieces: Vec<&'a [Moment]>,
    /// If it is a robot to which something happens.
    pub(crate) happening: Option<Happening>,
}

/// Something that happens to a robot.
pub(crate) struct Happening {
    /// When \[s\], and what; nothing if it is so from the start.
    pub(crate) what: Option<(f64, &'static str)>,
    /// Where a receiver that jumped had it \[m\].
    pub(crate) lies: Vec<(f64, f64)>,
}

/// One robot sees another.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Glimpse {
    /// Which of the moments that the picture shows.
    pub(crate) moment: usize,
    /// Their places in the list of drives.
    pub(crate) seer: usize,
    pub(crate) seen: usize,
    /// Where they are, the seer first \[m\].
    pub(crate) places: [(f64, f64); 2],
    /// Whether the seen is told.
    pub(crate) told: bool,
}

impl Glimpse {
    /// The whole has room for half of the moments, when there is an ellipse, and for who sees one another, once.
    fn is_of_the_whole(&self) -> bool {
        self.moment.is_multiple_of(GLIMPSES_PER_ELLIPSE) && self.seer < self.seen
    }
}

const WIDTH_PX: u32 = 1200;
const CAPTION_PX: u32 = 66;
const BESIDE_PX: u32 = 2 * MARGIN_PX + LABELS_PX;
const PANELS_BESIDE_ONE_ANOTHER: usize = 3;
/// Where something happens to the robots.
const LARGE_PANELS_BESIDE_ONE_ANOTHER: usize = 2;
/// Between two ticks nobody drives as far \[m\].
const JUMP_M: f64 = 0.5;
const PANEL_CAPTION_PX: u32 = 44;
const PANEL_MARGIN_PX: u32 = 10;
const PANEL_LABELS_PX: u32 = 28;
const PANEL_BESIDE_PX: u32 = 2 * PANEL_MARGIN_PX + PANEL_LABELS_PX;
/// Of a drive; more of them would show how the wheels shake.
const MOST_POINTS: usize = 300;
/// A robot that is carried is elsewhere so soon \[s\].
const AFTER_S: f64 = 0.03;
const ELLIPSE_STEPS: u32 = 48;
/// So many ellipses along a path.
const ELLIPSES: f64 = 15.0;
const GLIMPSES_PER_ELLIPSE: usize = 2;
/// So often in a run the picture shows who sees whom.
pub(crate) const GLIMPSES: usize = 30;

/// What the picture says in words.
pub(crate) struct Words<'a> {
    pub(crate) caption: &'a str,
    /// Below it, smaller.
    pub(crate) story: &'a str,
}

/// Draws every robot's drive into one plot with the `glimpses`, and below it each into a panel of its own.
pub(crate) fn draw_drives(
    file: &Path,
    words: &Words<'_>,
    drives: &[Drive<'_>],
    glimpses: &[Glimpse],
) -> Result<(), WriteError> {
    let layout = Layout::of(drives, glimpses);
    write_svg(file, (WIDTH_PX, layout.height_px()), |area| {
        area.fill(&WHITE)?;
        let (title, rest) = area.split_vertically(CAPTION_PX);
        draw_title(&title, words)?;
        let (keys, rest) = rest.split_vertically(layout.legend_px());
        layout.legend.draw(&keys)?;
        let (plot, panels) = rest.split_vertically(layout.whole_px());
        draw_whole(&plot, drives, glimpses, &layout.whole)?;
        let places = panels.split_evenly((layout.rows, layout.columns));
        for (index, (place, drive)) in places.iter().zip(drives).enumerate() {
            draw_panel(place, index, drive, glimpses, &layout.panels[index])?;
        }
        Ok(())
    })
}

/// Where everything has its place.
struct Layout {
    legend: Legend,
    whole: Window,
    /// All of one size.
    panels: Vec<Window>,
    /// Of panels.
    rows: usize,
    columns: usize,
}

impl Layout {
    /// What wheels alone make of a long drive leads far away: a panel shows twice as much as was really driven, not more.
    fn of(drives: &[Drive<'_>], glimpses: &[Glimpse]) -> Self {
        let places = |of: fn(&Moment) -> Pose| {
            let moments = drives
                .iter()
                .flat_map(|drive| drive.pieces.iter().copied().flatten());
            moments.map(of).map(|pose| (pose.x, pose.y))
        };
        let [truth, estimate, wheels] = [
            |m: &Moment| m.comparison.truth,
            |m: &Moment| m.comparison.estimate,
            |m: &Moment| m.by_wheels,
        ]
        .map(places);
        let driven = Window::around(truth.clone());
        let lies = drives.iter().flat_map(Drive::lies);
        let shared = || Window::around(truth.clone().chain(wheels.clone()));
        let (panels, columns) = if drives.iter().any(|drive| drive.happening.is_some()) {
            (own_windows(drives), LARGE_PANELS_BESIDE_ONE_ANOTHER)
        } else {
            let each = |_: &Drive<'_>| shared().within(&driven.scaled(2.0));
            (drives.iter().map(each).collect(), PANELS_BESIDE_ONE_ANOTHER)
        };
        Self {
            legend: legend(drives, glimpses),
            whole: Window::around(truth.clone().chain(estimate).chain(lies)),
            panels,
            rows: drives.len().div_ceil(columns).max(1),
            columns,
        }
    }

    fn legend_px(&self) -> u32 {
        self.legend.height_px(WIDTH_PX)
    }

    fn whole_px(&self) -> u32 {
        self.whole.height_px(WIDTH_PX, BESIDE_PX)
    }

    fn panel_px(&self) -> u32 {
        let panel_px = WIDTH_PX / u32::try_from(self.columns).unwrap_or(1);
        let heights = self.panels.iter();
        let heights = heights.map(|window| window.height_px(panel_px, PANEL_BESIDE_PX));
        PANEL_CAPTION_PX + heights.max().unwrap_or(0)
    }

    #[allow(clippy::cast_possible_truncation)] // A few rows.
    fn height_px(&self) -> u32 {
        CAPTION_PX + self.legend_px() + self.whole_px() + self.rows as u32 * self.panel_px()
    }
}

impl Drive<'_> {
    fn moments(&self) -> impl Iterator<Item = &Moment> + Clone {
        self.pieces.iter().copied().flatten()
    }

    fn lies(&self) -> impl Iterator<Item = (f64, f64)> + Clone {
        let lies = self.happening.iter().flat_map(|it| &it.lies);
        lies.copied()
    }
}

fn truth(m: &Moment) -> (f64, f64) {
    (m.comparison.truth.x, m.comparison.truth.y)
}

fn estimate(m: &Moment) -> (f64, f64) {
    (m.comparison.estimate.x, m.comparison.estimate.y)
}

/// Each around what happens to one robot, all as large as the largest.
fn own_windows(drives: &[Drive<'_>]) -> Vec<Window> {
    let around = |drive: &Drive<'_>| {
        let known = drive
            .moments()
            .filter(|m| m.state != BeliefState::Finding)
            .map(estimate);
        let truth = drive.moments().map(truth);
        Window::around(truth.chain(known).chain(drive.lies()))
    };
    let windows: Vec<_> = drives.iter().map(around).collect();
    let size = windows
        .iter()
        .map(Window::size)
        .fold([0.0_f64; 2], |[w, h], [x, y]| [w.max(x), h.max(y)]);
    windows.iter().map(|window| window.of_size(size)).collect()
}

fn draw_title(area: &Area<'_>, words: &Words<'_>) -> Result<(), Failure> {
    let font = |size: i32| ("sans-serif", size).into_font().color(&INK);
    area.draw(&Text::new(words.caption.to_owned(), (10, 12), font(20)))?;
    area.draw(&Text::new(words.story.to_owned(), (10, 40), font(14)))?;
    Ok(())
}

fn legend(drives: &[Drive<'_>], glimpses: &[Glimpse]) -> Legend {
    let solid = |name: &str, style| (name.to_owned(), Look::Solid(style));
    let dashed = |name: &str, style| (name.to_owned(), Look::Dashed(style));
    let mut looks = vec![
        solid("truth", line(TRUTH, 5)),
        solid("estimate", line(INK, 2)),
        ("start".into(), Look::Dot(INK.filled(), 5)),
        solid("95 % ellipse", INK.mix(0.2).stroke_width(12)),
        dashed("its wheels alone", wheels_style()),
    ];
    let happenings = || drives.iter().filter_map(|it| it.happening.as_ref());
    for state in [
        BeliefState::Finding,
        BeliefState::Contradicted,
        BeliefState::Lost,
    ] {
        if drives
            .iter()
            .any(|it| it.moments().any(|m| m.state == state))
        {
            looks.push(solid(state.name(), line(state_color(0, state), 4)));
        }
    }
    if happenings().any(|it| !it.lies.is_empty()) {
        looks.push(("receiver that jumped".into(), Look::Cross(lie_style())));
    }
    if happenings().next().is_none() {
        looks.push(solid("seen and told", glimpse_style()));
    }
    if glimpses.iter().any(|it| !it.told) {
        looks.push(dashed("seen, not told", glimpse_style()));
    }
    Legend::of_looks(looks)
}

fn wheels_style() -> ShapeStyle {
    INK.mix(0.75).stroke_width(1)
}

fn lie_style() -> ShapeStyle {
    INK.mix(0.55).stroke_width(1)
}

fn glimpse_style() -> ShapeStyle {
    INK.mix(0.35).stroke_width(1)
}

fn draw_whole(
    plot: &Area<'_>,
    drives: &[Drive<'_>],
    glimpses: &[Glimpse],
    window: &Window,
) -> Result<(), Failure> {
    let mut chart = window.chart(plot)?;
    draw_glimpses(
        &mut chart,
        glimpses.iter().filter(|it| it.is_of_the_whole()),
    )?;
    for drive in drives {
        draw_truth(&mut chart, drive, 5)?;
    }
    for (index, drive) in drives.iter().enumerate() {
        draw_lies(&mut chart, drive)?;
        draw_estimate(&mut chart, index, drive, false)?;
        draw_start(&mut chart, index, drive, drive.name)?;
        draw_event(&mut chart, drive)?;
    }
    Ok(())
}

fn draw_panel(
    place: &Area<'_>,
    index: usize,
    drive: &Drive<'_>,
    glimpses: &[Glimpse],
    window: &Window,
) -> Result<(), Failure> {
    let (caption, plot) = place.split_vertically(PANEL_CAPTION_PX);
    let name = ("sans-serif", 16).into_font().color(&robot_color(index));
    let note = ("sans-serif", 14).into_font().color(&INK);
    let left = i32::try_from(PANEL_MARGIN_PX + PANEL_LABELS_PX).unwrap_or(0);
    caption.draw(&Text::new(drive.name.to_owned(), (left, 6), name))?;
    caption.draw(&Text::new(drive.note.clone(), (left, 26), note))?;
    let mut chart = ChartBuilder::on(&plot)
        .margin(PANEL_MARGIN_PX)
        .x_label_area_size(PANEL_LABELS_PX)
        .y_label_area_size(PANEL_LABELS_PX)
        .build_cartesian_2d(window.x.0..window.x.1, window.y.0..window.y.1)?;
    chart
        .configure_mesh()
        .label_style(("sans-serif", 12).into_font().color(&INK))
        .light_line_style(TRANSPARENT)
        .bold_line_style(GRID)
        .axis_style(INK)
        .x_label_formatter(&tick_label)
        .y_label_formatter(&tick_label)
        .draw()?;
    draw_glimpses(&mut chart, glimpses.iter().filter(|it| it.seen == index))?;
    draw_truth(&mut chart, drive, 4)?;
    draw_lies(&mut chart, drive)?;
    draw_estimate(&mut chart, index, drive, true)?;
    draw_wheels(&mut chart, drive)?;
    draw_start(&mut chart, index, drive, "")?;
    draw_event(&mut chart, drive)
}

fn draw_glimpses<'a>(
    chart: &mut Chart<'_>,
    glimpses: impl Iterator<Item = &'a Glimpse> + Clone,
) -> Result<(), Failure> {
    let style = glimpse_style();
    let told = glimpses.clone().filter(|it| it.told);
    chart.draw_series(told.map(|it| PathElement::new(it.places, style)))?;
    let untold = glimpses.filter(|it| !it.told);
    chart.draw_series(untold.map(|it| dashed(it.places, style)))?;
    Ok(())
}

fn draw_truth(chart: &mut Chart<'_>, drive: &Drive<'_>, width: u32) -> Result<(), Failure> {
    let strokes = strokes(drive, |a, b| !jumps(truth(a), truth(b)));
    let lines = lines(&strokes, truth);
    chart.draw_series(lines.map(|(_, at)| PathElement::new(at, line(TRUTH, width))))?;
    Ok(())
}

fn draw_lies(chart: &mut Chart<'_>, drive: &Drive<'_>) -> Result<(), Failure> {
    let cross = |at| Cross::new(at, CROSS_PX, lie_style());
    chart.draw_series(drive.lies().map(cross))?;
    Ok(())
}

/// What happens, where the robot is then; a dashed line to where it is put down.
fn draw_event(chart: &mut Chart<'_>, drive: &Drive<'_>) -> Result<(), Failure> {
    let Some((at_s, what)) = drive.happening.as_ref().and_then(|it| it.what) else {
        return Ok(());
    };
    let before = drive
        .moments()
        .filter(|m| m.comparison.time_s < at_s)
        .last();
    let after = drive
        .moments()
        .find(|m| m.comparison.time_s > at_s + AFTER_S);
    let Some((from, to)) = before.map(truth).zip(after.map(truth)) else {
        return Ok(());
    };
    if jumps(from, to) {
        chart.draw_series([dashed([from, to], line(INK, 2))])?;
    }
    chart.draw_series([Circle::new(from, 6, line(INK, 2))])?;
    let font = ("sans-serif", 14).into_font().color(&INK);
    let (left, right) = Window::of(chart).x;
    let (aside_px, anchor) = if from.0 > f64::midpoint(left, right) {
        (-10, HPos::Right)
    } else {
        (10, HPos::Left)
    };
    let font = font.pos(Pos::new(anchor, VPos::Top));
    let text = Text::new(format!("{at_s:.0} s: {what}"), (aside_px, 8), font);
    chart.draw_series([EmptyElement::at(from) + text])?;
    Ok(())
}

fn draw_wheels(chart: &mut Chart<'_>, drive: &Drive<'_>) -> Result<(), Failure> {
    let wheels = |m: &Moment| (m.by_wheels.x, m.by_wheels.y);
    let window = Window::of(chart);
    let shown = lines(&drive.pieces, wheels).flat_map(|(_, at)| window.inside(&at));
    chart.draw_series(shown.map(|at| dashed(at, wheels_style())))?;
    Ok(())
}

/// Ellipses that are `filled` show better, and cover what is below them. Without that only those of robots that know where they are
/// are drawn: the others are as large as the whole picture.
fn draw_estimate(
    chart: &mut Chart<'_>,
    index: usize,
    drive: &Drive<'_>,
    filled: bool,
) -> Result<(), Failure> {
    let color = |m: &Moment| state_color(index, m.state);
    let ellipses: Vec<_> = at_intervals(drive)
        .filter(|m| filled || m.state == BeliefState::Ok)
        .map(|m| (m, ellipse(m)))
        .collect();
    let window = Window::of(chart);
    if filled {
        // One that holds the whole window would only tint it.
        let shown = ellipses
            .iter()
            .filter(|(_, at)| !window.inside(at).is_empty());
        let polygon = |(m, at): &(&Moment, Vec<_>)| {
            let strength = if m.state == BeliefState::Ok {
                0.15
            } else {
                0.07
            };
            Polygon::new(window.clamped(at), color(m).mix(strength))
        };
        chart.draw_series(shown.map(polygon))?;
    }
    let edges = ellipses.iter().flat_map(|(m, at)| {
        let edge = color(m).mix(0.6).stroke_width(1);
        window
            .inside(at)
            .into_iter()
            .map(move |at| PathElement::new(at, edge))
    });
    chart.draw_series(edges)?;
    let goes_on = |a: &Moment, b: &Moment| a.state == b.state && !jumps(estimate(a), estimate(b));
    let strokes = strokes(drive, goes_on);
    let width = |m: &Moment| if m.state == BeliefState::Ok { 2 } else { 4 };
    let stroke =
        |(first, at): (&Moment, Vec<_>)| PathElement::new(at, line(color(first), width(first)));
    chart.draw_series(lines(&strokes, estimate).map(stroke))?;
    Ok(())
}

fn draw_start(
    chart: &mut Chart<'_>,
    index: usize,
    drive: &Drive<'_>,
    name: &str,
) -> Result<(), Failure> {
    let first = drive.pieces.iter().copied().flatten().next();
    let start = first.map(|m| (m.comparison.truth.x, m.comparison.truth.y));
    let dot = robot_color(index).filled();
    chart.draw_series(start.map(|at| Circle::new(at, 5, dot)))?;
    // Colours start over after ten robots; names do not.
    let font = ("sans-serif", 14).into_font().color(&INK);
    let text = |at| EmptyElement::at(at) + Text::new(name.to_owned(), (8, -16), font.clone());
    chart.draw_series(start.map(text))?;
    Ok(())
}

fn ellipse(moment: &Moment) -> Vec<(f64, f64)> {
    let mean = [moment.comparison.estimate.x, moment.comparison.estimate.y];
    outline(mean, moment.covariance, ELLIPSE_STEPS)
}

/// The first moment of each interval of a length that suits the whole.
fn at_intervals<'a>(drive: &'a Drive<'_>) -> impl Iterator<Item = &'a Moment> {
    let moments = || drive.pieces.iter().copied().flatten();
    let time_s = |moment: &Moment| moment.comparison.time_s;
    let length_s = moments().last().map_or(0.0, time_s);
    let interval_s = (length_s / ELLIPSES).max(0.1);
    let mut next_s = interval_s;
    moments().filter(move |moment| {
        let due = time_s(moment) >= next_s;
        while next_s <= time_s(moment) {
            next_s += interval_s;
        }
        due
    })
}

/// The pieces of a drive, cut once more where a line does not go on.
fn strokes<'a>(drive: &Drive<'a>, goes_on: impl Fn(&Moment, &Moment) -> bool) -> Vec<&'a [Moment]> {
    let pieces = drive.pieces.iter().copied();
    pieces.flat_map(|piece| piece.chunk_by(&goes_on)).collect()
}

fn jumps(a: (f64, f64), b: (f64, f64)) -> bool {
    (a.0 - b.0).hypot(a.1 - b.1) > JUMP_M
}

/// Every stroke as a line of not too many points, and its first moment.
fn lines<'a>(
    strokes: &'a [&'a [Moment]],
    place: impl Fn(&Moment) -> (f64, f64),
) -> impl Iterator<Item = (&'a Moment, Vec<(f64, f64)>)> {
    thinned(strokes, MOST_POINTS).filter_map(move |stroke| {
        let mut stroke = stroke.peekable();
        let first = *stroke.peek()?;
        Some((first, stroke.map(&place).collect()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comparison::Comparison;

    /// North, and the wheels believe that it is east.
    fn moments(from: i32, to: i32) -> Vec<Moment> {
        (from..to)
            .map(|k| {
                let way_m = 0.1 * f64::from(k);
                let truth = Pose::new(1.0, way_m, 0.0);
                let comparison = Comparison {
                    time_s: 0.1 * f64::from(k),
                    truth,
                    estimate: Pose { x: 1.05, ..truth },
                    sigma: [0.1; 3],
                };
                Moment {
                    comparison,
                    covariance: [0.01, 0.0, 0.01],
                    nees: 0.0,
                    state: BeliefState::Ok,
                    by_wheels: Pose::new(1.0 + way_m, 0.0, 0.0),
                }
            })
            .collect()
    }

    fn drive<'a>(name: &'a str, pieces: Vec<&'a [Moment]>) -> Drive<'a> {
        Drive {
            name,
            note: format!("a note on {name}"),
            pieces,
            happening: None,
        }
    }

    const WORDS: Words<'_> = Words {
        caption: "Ways",
        story: "and what they are about",
    };

    fn drawn(drives: &[Drive<'_>], glimpses: &[Glimpse]) -> String {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("paths.svg");
        draw_drives(&file, &WORDS, drives, glimpses).unwrap();
        std::fs::read_to_string(&file).unwrap()
    }

    #[test]
    fn everybody_has_a_name_a_note_and_a_panel_and_all_looks_are_explained() {
        let moments = moments(0, 100);
        let drives = ["one", "two", "three", "four"].map(|name| drive(name, vec![&moments]));
        let svg = drawn(&drives, &[]);
        for text in [
            "Ways",
            "and what they are about",
            "truth",
            "start",
            "estimate",
            "95 % ellipse",
            "its wheels alone",
            "seen and told",
            "a note on one",
            "a note on four",
        ] {
            assert!(svg.contains(text), "{text} is missing");
        }
        assert_eq!(
            svg.matches("<polygon").count(),
            4 * 15,
            "an ellipse for each fifteenth of each drive, filled in its panel"
        );
    }

    #[test]
    fn who_sees_whom_is_in_the_plot_once_and_in_the_panel_of_whoever_is_seen() {
        let moments = moments(0, 100);
        let drives = ["one", "two"].map(|name| drive(name, vec![&moments]));
        let glimpse = |moment, seer, seen| Glimpse {
            moment,
            seer,
            seen,
            places: [(1.0, 3.0), (1.0, 4.0)],
            told: true,
        };
        let lines = |glimpses: &[Glimpse]| drawn(&drives, glimpses).matches("<polyline").count();
        let none = lines(&[]);
        assert_eq!(lines(&[glimpse(2, 0, 1)]), none + 2, "the plot and a panel");
        assert_eq!(lines(&[glimpse(2, 0, 1), glimpse(2, 1, 0)]), none + 3);
        assert_eq!(lines(&[glimpse(3, 0, 1)]), none + 1, "a panel");
        let untold = Glimpse {
            told: false,
            ..glimpse(3, 0, 1)
        };
        assert!(lines(&[untold]) > none + 2, "dashes");
        let says = |glimpses: &[Glimpse]| drawn(&drives, glimpses).contains("seen, not told");
        assert!(says(&[untold]) && !says(&[glimpse(3, 0, 1)]));
    }

    #[test]
    fn a_drive_with_a_gap_and_a_robot_that_never_spoke_do_not_spoil_the_picture() {
        let [before, after] = [moments(0, 40), moments(60, 100)];
        let drives = [
            drive("one", vec![&before, &after]),
            drive("two", Vec::new()),
        ];
        let svg = drawn(&drives, &[]);
        assert!(svg.contains("a note on two"));
        assert!(!svg.contains("NaN"), "{svg}");
    }

    #[test]
    fn what_happens_is_named_and_a_robot_that_does_not_know_has_another_colour() {
        let mut moments = moments(0, 100);
        for moment in &mut moments[50..] {
            moment.comparison.truth.x += 10.0;
            moment.state = BeliefState::Contradicted;
            moment.covariance = [1e6, 0.0, 1e6];
        }
        let lies = vec![(2.0, 2.0), (2.0, 3.0)];
        let carried = Drive {
            happening: Some(Happening {
                what: Some((5.0, "carried")),
                lies,
            }),
            ..drive("one", vec![&moments])
        };
        let svg = drawn(&[carried], &[]);
        for text in ["5 s: carried", "contradicted", "receiver that jumped"] {
            assert!(svg.contains(text), "{text} is missing");
        }
        let RGBColor(r, g, b) = state_color(0, BeliefState::Contradicted);
        let color = format!("#{r:02X}{g:02X}{b:02X}");
        assert!(svg.matches(&color).count() >= 3, "key, plot and panel");
        assert!(!svg.contains(">finding<") && !svg.contains("seen and told"));
        let whole_way = strokes(&drive("one", vec![&moments]), |_, _| true).len();
        let driven = |a: &Moment, b: &Moment| !jumps(truth(a), truth(b));
        let cut = strokes(&drive("one", vec![&moments]), driven).len();
        assert_eq!((whole_way, cut), (1, 2));
    }

    #[test]
    fn wheels_that_lead_far_away_do_not_make_the_panel_useless() {
        let mut moments = moments(0, 100);
        moments[99].by_wheels.x = 1000.0;
        let layout = Layout::of(&[drive("one", vec![&moments])], &[]);
        let (low, high) = layout.panels[0].x;
        assert!(high - low < 30.0, "{low} {high}");
    }
}
