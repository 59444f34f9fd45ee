//! One scan of a recorded room with robots in it, drawn: what the scanner met, where robots were believed to be, stand and were found.

use std::fmt::Write as _;
use std::path::Path;

use coloc_scan::{Finder, Look, Prior, Seen, View};

use super::room::{Room, read_all};
use super::scene::{Scene, own_heading};
use super::{Row, rows, settings};
use crate::random::{Noise, Purpose};

/// Pixels of a metre, and what is shown: from behind the scanner to before it, and to both sides \[m\].
const SCALE: f64 = 90.0;
const SHOWN_M: [f64; 4] = [-0.6, 6.6, -3.6, 3.6];
/// Radius in σ of an ellipse that holds 95 %.
const SIGMAS: f64 = 2.447_746_830_680_816;
/// Ellipses of what was found are drawn so many times as large: of millimetres nothing would be seen.
const LARGER: f64 = 10.0;
/// The row that is drawn: both looks.
const ROW: &str = "two cylinders and rectangles";
const STYLE: &str = "<style>text{font:14px sans-serif;fill:#333}.room{fill:#888}.true{fill:#ddd;stroke:#777}\
.prior{fill:none;stroke:#36c;stroke-dasharray:6 4}.said{fill:none;stroke:#c30;stroke-width:2}.sure{fill:#c30;fill-opacity:.25;stroke:#c30}\
.doubt{stroke:#e90;stroke-width:3}</style>";
const WORDS: [(&str, &str); 5] = [
    ("#888", "what the scanner met, in a recorded room"),
    ("#777", "robots, as they stand (number 0: none of the team)"),
    ("#36c", "where each is believed to be, 95 %"),
    ("#c30", "found and named, with its 95 % ten times as large"),
    (
        "#e90",
        "looks like a robot; who it is, or that it is one, is not sure",
    ),
];

/// The picture of the first scan in which `told` robots or more are named.
///
/// # Errors
/// There are no recordings, or there is no such scan.
pub fn picture(data: &Path, seed: u64, told: usize) -> Result<String, String> {
    let recordings = read_all(&data.join("carmen_laser"))?;
    let rows = rows();
    let row = rows.iter().find(|row| row.name == ROW);
    let row = row.ok_or("the row that is drawn is gone")?;
    let mut finder = Finder::new(settings(row));
    let rooms = recordings.iter().flat_map(|it| &it.rooms).enumerate();
    for (place, room) in rooms {
        let drawn = drawn(room, row, &mut finder, seed, place);
        if let Some((scene, seen, bodies)) = drawn.filter(|(_, seen, _)| seen.len() >= told) {
            return Ok(svg(&scene, row, &seen, &bodies));
        }
    }
    Err(format!("there is no scan in which {told} robots are named"))
}

type Drawn = (Scene, Vec<Seen>, Vec<[f64; 2]>);

fn drawn(room: &Room, row: &Row, finder: &mut Finder, seed: u64, place: usize) -> Option<Drawn> {
    let mut draws = Noise::new(seed, 0).draws(Purpose::Laser, 1, place, 0);
    let scene = Scene::draw(room, row, &mut draws);
    let view = View::check(scene.raw()).ok()?;
    let seen = finder.find_turned(&view, scene.motion, &scene.priors, own_heading(row));
    let seen = seen.to_vec();
    let bodies = finder.bodies().map(|(centre, _)| centre).collect();
    Some((scene, seen, bodies))
}

/// Forward is to the right, left is up.
fn at([x, y]: [f64; 2]) -> [f64; 2] {
    [SCALE * (x - SHOWN_M[0]), SCALE * (SHOWN_M[3] - y)]
}

fn svg(scene: &Scene, row: &Row, seen: &[Seen], bodies: &[[f64; 2]]) -> String {
    let [width, height] = at([SHOWN_M[1], SHOWN_M[2]]);
    #[allow(clippy::cast_precision_loss)] // A few lines.
    let line = |place: usize| height + 22.0 + 20.0 * place as f64;
    let whole = line(WORDS.len());
    let mut parts = vec![
        format!("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {whole:.0}\">"),
        STYLE.into(),
        format!("<rect width=\"{width:.0}\" height=\"{whole:.0}\" fill=\"#fff\"/>"),
        format!(
            "<clipPath id=\"shown\"><rect width=\"{width:.0}\" height=\"{height:.0}\"/></clipPath>"
        ),
        "<g clip-path=\"url(#shown)\">".into(),
    ];
    let middle_s = seen.first().map_or(0.0, |it| it.time_s);
    for robot in &scene.robots {
        let pose = scene.seen_from(robot, middle_s);
        let place = robot.number.map_or(0, |it| usize::from(it) - 1);
        let look = &row.looks[place % row.looks.len()];
        parts.push(outline(look, pose, "true"));
        let [x, y] = at([pose[0], pose[1]]);
        let number = robot.number.unwrap_or(0);
        parts.push(format!("<text x=\"{x:.1}\" y=\"{y:.1}\">{number}</text>"));
    }
    parts.extend(points(scene));
    parts.push(scanner());
    for Prior {
        pose, covariance, ..
    } in &scene.priors
    {
        parts.push(ellipse(*pose, covariance, SIGMAS, "prior"));
    }
    for it in seen {
        let look = usize::from(it.robot) - 1;
        parts.push(outline(&row.looks[look % row.looks.len()], it.pose, "said"));
        parts.push(ellipse(it.pose, &it.covariance, SIGMAS * LARGER, "sure"));
    }
    let is_said = |body: &[f64; 2]| {
        let near = |it: &Seen| (it.pose[0] - body[0]).hypot(it.pose[1] - body[1]) < 0.3;
        seen.iter().any(near)
    };
    parts.extend(bodies.iter().filter(|it| !is_said(it)).map(cross));
    parts.push("</g>".into());
    for (place, (colour, words)) in WORDS.iter().enumerate() {
        let y = line(place);
        parts.push(format!(
            "<circle cx=\"16\" cy=\"{:.0}\" r=\"5\" fill=\"{colour}\"/><text x=\"30\" y=\"{y:.0}\">{words}</text>",
            y - 5.0
        ));
    }
    parts.push("</svg>\n".into());
    parts.join("\n")
}

/// Where the scanner stands, and which way it looks.
fn scanner() -> String {
    let [[x, y], [ax, ay], [bx, by]] = [[0.15, 0.0], [-0.1, 0.1], [-0.1, -0.1]].map(at);
    format!("<path d=\"M{x:.1} {y:.1}L{ax:.1} {ay:.1}L{bx:.1} {by:.1}Z\" fill=\"#333\"/>")
}

fn points(scene: &Scene) -> impl Iterator<Item = String> {
    let raw = scene.raw();
    let (first, step) = (
        f64::from(raw.angle_min_rad),
        f64::from(raw.angle_increment_rad),
    );
    let ranges = (0_u32..)
        .zip(raw.ranges)
        .filter(|(_, range)| range.is_finite());
    ranges.map(move |(place, range)| {
        let (sin, cos) = (first + f64::from(place) * step).sin_cos();
        let [x, y] = at([f64::from(*range) * cos, f64::from(*range) * sin]);
        format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2\" class=\"room\"/>")
    })
}

fn outline(look: &Look, [x, y, heading]: [f64; 3], class: &str) -> String {
    let [cx, cy] = at([x, y]);
    match look {
        Look::Rectangle {
            length_m,
            width_m,
            centre_m,
        } => {
            let [left, top] =
                [centre_m[0] - 0.5 * length_m, centre_m[1] - 0.5 * width_m].map(|it| SCALE * it);
            format!(
                "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{:.1}\" transform=\"translate({cx:.1} {cy:.1}) rotate({:.2})\" class=\"{class}\"/>",
                SCALE * length_m,
                SCALE * width_m,
                -heading.to_degrees()
            )
        }
        _ => format!(
            "<circle cx=\"{cx:.1}\" cy=\"{cy:.1}\" r=\"{:.1}\" class=\"{class}\"/>",
            SCALE * look.reach_m()
        ),
    }
}

/// Of the first two rows and columns.
fn ellipse([x, y, _]: [f64; 3], covariance: &[[f64; 3]; 3], sigmas: f64, class: &str) -> String {
    let [[a, b, _], [_, d, _], _] = *covariance;
    let (mean, half) = (0.5 * (a + d), (0.5 * (a - d)).hypot(b));
    let turned = 0.5 * (2.0 * b).atan2(a - d);
    let [long, short] = [mean + half, mean - half].map(|it| SCALE * sigmas * it.max(0.0).sqrt());
    let [cx, cy] = at([x, y]);
    format!(
        "<ellipse rx=\"{long:.1}\" ry=\"{short:.1}\" transform=\"translate({cx:.1} {cy:.1}) rotate({:.2})\" class=\"{class}\"/>",
        -turned.to_degrees()
    )
}

fn cross(body: &[f64; 2]) -> String {
    let mut path = String::new();
    let [x, y] = at(*body);
    for (from, to) in [([-7.0, -7.0], [7.0, 7.0]), ([-7.0, 7.0], [7.0, -7.0])] {
        // A string takes all.
        let _ = write!(
            path,
            "M{:.1} {:.1}L{:.1} {:.1}",
            x + from[0],
            y + from[1],
            x + to[0],
            y + to[1]
        );
    }
    format!("<path d=\"{path}\" class=\"doubt\"/>")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ellipse_lies_along_what_is_uncertain() {
        let ahead = ellipse(
            [1.0, 0.0, 0.0],
            &[[0.04, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0; 3]],
            1.0,
            "sure",
        );
        assert!(ahead.contains("rx=\"18.0\" ry=\"9.0\""), "{ahead}");
        assert!(ahead.contains("rotate(-0.00)"), "{ahead}");
        let aside = ellipse(
            [1.0, 0.0, 0.0],
            &[[0.01, 0.0, 0.0], [0.0, 0.04, 0.0], [0.0; 3]],
            1.0,
            "sure",
        );
        assert!(aside.contains("rotate(-90.00)"), "{aside}");
    }
}
