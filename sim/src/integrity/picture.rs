//! Pictures of the paper's experiments, after its figures 5 and 12 to 14.

use std::fmt::Write as _;
use std::path::Path;

use super::Form;
use super::paper::{self, Curves, Scene};

const STYLE: &str = "<style>text{font:13px sans-serif;fill:#333}.axis{stroke:#bbb;fill:none}.greedy{stroke:#c30;fill:none;stroke-width:2}\
.uniform{stroke:#36c;fill:none;stroke-width:2;stroke-dasharray:6 4}.outer{fill:#36c;fill-opacity:.22;stroke:#36c}\
.inner{fill:none;stroke:#36c;stroke-dasharray:3 3}.seen{stroke:#ccc}.truth{fill:#222}.centre{stroke:#c30;stroke-width:2}</style>";

/// Draws all into `folder`.
///
/// # Errors
/// A program failed, or a file could not be written.
pub fn draw(form: &Form, folder: &Path) -> Result<(), String> {
    let curves = paper::curves(form);
    let write = |name: &str, text: String| {
        let path = folder.join(name);
        std::fs::write(&path, text).map_err(|why| format!("{}: {why}", path.display()))
    };
    write("searches.svg", searches(&curves))?;
    for (name, with_ranges, title) in [
        (
            "bearings.svg",
            false,
            "bearings ±2° alone, scale by the second robot",
        ),
        ("ranges.svg", true, "bearings ±2°, ranges ±5 %"),
    ] {
        let scene = paper::scene(form, with_ranges).ok_or("a program of the formation failed")?;
        write(name, region(&scene, title))?;
    }
    Ok(())
}

/// One of two charts side by side.
struct Chart {
    left: f64,
    most: f64,
    steps: u32,
}

const TOP: f64 = 40.0;
const HEIGHT: f64 = 260.0;
const WIDTH: f64 = 340.0;

impl Chart {
    #[allow(clippy::cast_precision_loss)] // A dozen.
    fn x(&self, searches: usize) -> f64 {
        self.left + WIDTH * (searches as f64 - 4.0) / 11.0
    }

    fn y(&self, value: f64) -> f64 {
        TOP + HEIGHT * (1.0 - value / self.most)
    }

    fn write(&self, title: &str, curves: &[[f64; 12]; 2], into: &mut String) {
        let _ = write!(into, "<text x=\"{:.0}\" y=\"24\">{title}</text>", self.left); // A string takes all.
        for step in 0..=self.steps {
            let value = self.most * f64::from(step) / f64::from(self.steps);
            let y = self.y(value);
            let _ = write!(
                into,
                "<path class=\"axis\" d=\"M{:.0} {y:.1}h{WIDTH:.0}\"/><text x=\"{:.0}\" y=\"{:.1}\" text-anchor=\"end\">{value:.1}</text>",
                self.left,
                self.left - 6.0,
                y + 4.0
            );
        }
        for searches in (4..=15).step_by(1) {
            let _ = write!(
                into,
                "<text x=\"{:.1}\" y=\"{:.0}\" text-anchor=\"middle\">{searches}</text>",
                self.x(searches),
                TOP + HEIGHT + 18.0
            );
        }
        for (class, curve) in ["greedy", "uniform"].into_iter().zip(curves) {
            let points: Vec<_> = (4..)
                .zip(curve)
                .map(|(searches, value)| format!("{:.1},{:.1}", self.x(searches), self.y(*value)))
                .collect();
            let _ = write!(
                into,
                "<polyline class=\"{class}\" points=\"{}\"/>",
                points.join(" ")
            );
        }
    }
}

fn searches(curves: &Curves) -> String {
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 830 370\">{STYLE}<rect width=\"830\" height=\"370\" fill=\"#fff\"/>"
    );
    let most = curves.gap.iter().flatten().copied().fold(0.0, f64::max);
    let most = (10.0 * most).ceil() / 10.0;
    let left = Chart {
        left: 50.0,
        most: 1.0,
        steps: 5,
    };
    left.write("inner of outer area (PR)", &curves.ratio, &mut text);
    let right = Chart {
        left: 460.0,
        most,
        steps: 4,
    };
    right.write("outer less inner area (ΔP), m²", &curves.gap, &mut text);
    let words = [
        ("greedy", 60.0, "in the largest triangle"),
        ("uniform", 300.0, "in equally spaced directions"),
    ];
    for (class, x, word) in words {
        let _ = write!(
            text,
            "<path class=\"{class}\" d=\"M{x} 348h40\"/><text x=\"{}\" y=\"352\">{word}</text>",
            x + 48.0
        );
    }
    text.push_str(
        "<text x=\"560\" y=\"352\">searches a robot, mean over formations</text></svg>\n",
    );
    text
}

/// Pixels of a metre.
const SCALE: f64 = 95.0;

fn region(scene: &Scene, title: &str) -> String {
    let corners = || {
        let outer = scene.robots.iter().flat_map(|it| &it.outer);
        outer.chain(scene.robots.iter().map(|it| &it.truth))
    };
    let least = [0, 1].map(|axis| corners().map(|it| it[axis]).fold(f64::INFINITY, f64::min) - 0.2);
    let most = [0, 1].map(|axis| corners().map(|it| it[axis]).fold(-f64::INFINITY, f64::max) + 0.2);
    let at = |[x, y]: [f64; 2]| [SCALE * (x - least[0]), 30.0 + SCALE * (most[1] - y)];
    let [width, height] = at([most[0], least[1]]);
    let whole = height + 50.0;
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {whole:.0}\">{STYLE}<rect width=\"{width:.0}\" height=\"{whole:.0}\" fill=\"#fff\"/><text x=\"8\" y=\"20\">{title}</text>"
    );
    let points = |corners: &[[f64; 2]]| {
        let all = corners.iter().map(|it| {
            let [x, y] = at(*it);
            format!("{x:.1},{y:.1}")
        });
        all.collect::<Vec<_>>().join(" ")
    };
    for [from, to] in &scene.seen {
        let ([x, y], [u, v]) = (at(*from), at(*to));
        let _ = write!(
            text,
            "<path class=\"seen\" d=\"M{x:.1} {y:.1}L{u:.1} {v:.1}\"/>"
        );
    }
    for robot in &scene.robots {
        let _ = write!(
            text,
            "<polygon class=\"outer\" points=\"{}\"/><polygon class=\"inner\" points=\"{}\"/>",
            points(&robot.outer),
            points(&robot.inner)
        );
        let [x, y] = at(robot.truth);
        let _ = write!(
            text,
            "<circle class=\"truth\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\"/>"
        );
        if let Some(centre) = robot.centre {
            let [x, y] = at(centre);
            let _ = write!(
                text,
                "<path class=\"centre\" d=\"M{:.1} {:.1}l10 10m0 -10l-10 10\"/>",
                x - 5.0,
                y - 5.0
            );
        }
    }
    let y = whole - 14.0;
    let _ = write!(
        text,
        "<circle class=\"truth\" cx=\"14\" cy=\"{:.0}\" r=\"4\"/><text x=\"24\" y=\"{y:.0}\">truth</text>\
<path class=\"centre\" d=\"M80 {:.0}l10 10m0 -10l-10 10\"/><text x=\"98\" y=\"{y:.0}\">centre of the region, the estimate</text>\
<rect class=\"outer\" x=\"330\" y=\"{:.0}\" width=\"22\" height=\"12\"/><text x=\"358\" y=\"{y:.0}\">region: outer, inner polygon</text></svg>",
        y - 4.0,
        y - 9.0,
        y - 10.0
    );
    text.push('\n');
    text
}
