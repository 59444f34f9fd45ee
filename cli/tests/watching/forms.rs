//! What `coloc listen` prints, read back.

use coloc_shm_types::Unfit;
use serde_json::Value;

use crate::program::{Coloc, Ended};
use crate::robot::{Ground, Robot, stamp_ns, x};

fn listen(form: &str, count: u64) -> Ended {
    listen_to(form, count, None)
}

fn listen_to(form: &str, count: u64, unfit: Option<(Unfit, f32)>) -> Ended {
    let ground = Ground::new();
    let mut robot = Robot::start(&ground, "r1", 4);
    robot.unfit = unfit;
    let words = format!("listen r1 {form} --count {count}");
    Coloc::start(&words, &ground.root()).end(|| robot.say())
}

/// Whether the numbers grow one by one, but for those of which it was said that they are lost.
fn assert_whole(ticks: &[u64], ended: &Ended) {
    let gaps = ticks.windows(2).map(|pair| pair[1] - pair[0] - 1);
    let losses = ended.said.iter().filter(|line| line.contains("were lost"));
    let lost = losses.map(|line| line.split_whitespace().nth(1).unwrap().parse::<u64>());
    let lost = lost.map(Result::unwrap);
    assert_eq!(gaps.sum::<u64>(), lost.sum::<u64>(), "{ended:?}");
}

#[test]
fn json_says_every_estimate_in_full() {
    let ended = listen("--json", 40);
    assert_eq!(
        (ended.status, ended.printed.len()),
        (Some(0), 40),
        "{ended:?}"
    );
    let mut ticks = Vec::new();
    for line in &ended.printed {
        let object: Value = serde_json::from_str(line).unwrap();
        let tick = object["tick"].as_u64().unwrap();
        assert_eq!(object["robot"], "r1");
        assert_eq!(object["boot_ns"], stamp_ns(tick));
        assert_eq!(object["x_m"], x(tick));
        assert_eq!(object["sigma_y_m"], 0.3);
        assert_eq!(object["covariance"][8], 0.0001);
        assert_eq!(
            (&object["odometry_health"], &object["fit"]),
            (&"ok".into(), &true.into())
        );
        ticks.push(tick);
    }
    assert_whole(&ticks, &ended);
}

#[test]
fn csv_has_one_heading_and_a_row_for_every_estimate() {
    let ended = listen("--csv", 40);
    assert_eq!(
        (ended.status, ended.printed.len()),
        (Some(0), 41),
        "{ended:?}"
    );
    let heading: Vec<&str> = ended.printed[0].split(',').collect();
    let column = |name: &str| heading.iter().position(|it| *it == name).unwrap();
    let (tick, x_m, sigma) = (column("tick"), column("x_m"), column("sigma_heading_rad"));
    let mut ticks = Vec::new();
    for line in &ended.printed[1..] {
        let row: Vec<&str> = line.split(',').collect();
        assert_eq!(row.len(), heading.len(), "{line}");
        let number: u64 = row[tick].parse().unwrap();
        assert_eq!(row[x_m].parse(), Ok(x(number)));
        assert_eq!(row[sigma], "0.01");
        ticks.push(number);
    }
    assert_whole(&ticks, &ended);
}

#[test]
fn tum_is_a_trajectory() {
    let ended = listen("--tum", 40);
    assert_eq!(
        (ended.status, ended.printed.len()),
        (Some(0), 40),
        "{ended:?}"
    );
    let mut ticks = Vec::new();
    for line in &ended.printed {
        let (timestamp, rest) = line.split_once(' ').unwrap();
        let stamp: i64 = timestamp.replace('.', "").parse().unwrap();
        let tick = u64::try_from((stamp - stamp_ns(0)) / 20_000_000).unwrap();
        assert_eq!(stamp, stamp_ns(tick));
        let numbers: Vec<f64> = rest.split(' ').map(|word| word.parse().unwrap()).collect();
        let half = std::f64::consts::FRAC_PI_4;
        let expected = [x(tick), -1.25, 0.0, 0.0, 0.0, half.sin(), half.cos()];
        assert_eq!(numbers, expected);
        ticks.push(tick);
    }
    assert_whole(&ticks, &ended);
}

#[test]
fn why_it_is_not_fit_to_drive_on_is_said_once_to_people_and_in_every_line_to_programs() {
    let unfit = Some((Unfit::Heading, 0.005));
    let why = "heading 0.6° > 0.3°";
    let ended = listen_to("", 3, unfit);
    let said: Vec<_> = ended.said.iter().filter(|it| it.contains("fit")).collect();
    let expected = format!("coloc: r1 is not fit to drive on: {why}");
    assert_eq!(said, [&expected], "{ended:?}");
    assert!(ended.printed[2].contains(" unfit "), "{ended:?}");
    let ended = listen_to("--json", 3, unfit);
    for line in &ended.printed {
        let object: Value = serde_json::from_str(line).unwrap();
        assert_eq!(object["unfit"], why, "{line}");
    }
    assert!(!ended.said.iter().any(|it| it.contains("fit")), "{ended:?}");
}

/// By the stamps it is 50 Hz: of ten estimates one is shown.
#[test]
fn people_get_a_heading_and_five_lines_a_second_of_80_columns() {
    let ended = listen("", 3);
    assert_eq!(
        (ended.status, ended.printed.len()),
        (Some(0), 5),
        "{ended:?}"
    );
    assert!(
        ended.printed[0].contains("belief       odometry"),
        "{ended:?}"
    );
    let fits = |line: &String| line.chars().count() <= 80;
    assert!(ended.printed.iter().all(fits), "{ended:?}");
    let tenths: Vec<u64> = ended.printed[2..]
        .iter()
        .map(|line| {
            let rest = "-1.250   90.0 0.200 0.300 0.57  0.50  14.3 ok           ok";
            assert!(line.ends_with(rest), "{line}");
            let shown: f64 = line.split_whitespace().nth(1).unwrap().parse().unwrap();
            let is_it = |tick: &u64| x(*tick) >= shown - 0.05;
            (0..100_000).find(is_it).unwrap() / 10
        })
        .collect();
    assert!(
        tenths.windows(2).all(|pair| pair[1] > pair[0]),
        "{tenths:?}"
    );
}
