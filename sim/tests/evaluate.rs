//! The evaluation as a whole: same bits on any number of threads, the product's two paths agree, figures in bounds.

use coloc_estimator::{Belief, Covariance3, Pose};
use coloc_sim::evaluate::{EvalConfig, EvalError, EvalReport, EvalWorld, evaluate};
use coloc_sim::method::stepwise::Stepwise;
use coloc_sim::method::team::Team;
use coloc_sim::method::{FilterSettings, Kind, Method, rule::Rule};
use coloc_sim::{Scenario, Sensors, Synthetic, SyntheticConfig, World};

fn config(scenario: &str, methods: &[Kind], runs: u16, seconds: f64) -> EvalConfig {
    let mut config = EvalConfig::new(EvalWorld::Synthetic(SyntheticConfig::default()));
    config.scenario = Scenario::named(scenario).expect("a scenario");
    config.methods = methods.to_vec();
    config.seconds = Some(seconds);
    config.runs = runs;
    config
}

fn run(config: &EvalConfig) -> EvalReport {
    evaluate(config, &|_| ()).expect("a sensible configuration")
}

/// The coloc team and the product's `step`, side by side through a minute of `scenario`: `compare` gets every step.
fn side_by_side(scenario: &str, steps: usize, compare: &mut dyn FnMut(usize, &Belief, &Belief)) {
    let scenario = Scenario::named(scenario).expect("a scenario");
    let world = Synthetic::new(&SyntheticConfig {
        seconds: 60.0,
        ..SyntheticConfig::default()
    });
    let settings = FilterSettings::new(&scenario, world.dt_s());
    let p0 = Covariance3::diagonal([0.0025, 0.0025, 0.001]).expect("positive");
    let begin = |robot| Belief::independent(world.initial(robot).expect("known"), p0);
    let initial: Vec<Belief> = (0..5).map(begin).collect();
    let mut team = Team::new(
        Rule::Split(settings.product.fusion),
        settings.clone(),
        &initial,
    );
    let mut product = Stepwise::new(settings, &initial);
    let sensors = Sensors::new(&world, &scenario, 5, 0);
    for step in 1..steps {
        let inputs = sensors.at(step);
        team.step(&inputs, &mut |_| ());
        product.step(&inputs, &mut |_| ());
        for robot in 0..5 {
            let beliefs = (team.belief(robot), product.belief(robot));
            let (Some(team), Some(product)) = beliefs else {
                panic!("no robot {robot}")
            };
            compare(step, team, product);
        }
    }
}

/// Steps at which the product's functions in Algorithm 4's order and its `step` differ in any bit of any belief.
fn differing_steps(scenario: &str, steps: usize) -> Vec<usize> {
    let mut differing = Vec::new();
    side_by_side(scenario, steps, &mut |step, team, product| {
        if team != product {
            differing.push(step);
        }
    });
    differing
}

#[test]
fn silent_odometry_differs_only_by_how_time_is_cut() {
    // The product crosses a silence in one stride from event to event, the grid in steps of 20 ms.
    let (mut differences, mut largest_sigmas) = (0, 0.0_f64);
    side_by_side("drop-outs", 2000, &mut |_, team, product| {
        differences += usize::from(team != product);
        let sigma = team.total().matrix().diagonal().map(f64::sqrt);
        let [a, b] = [team.pose, product.pose].map(Pose::to_vector);
        let off = (a - b)
            .map(coloc_estimator::angle::wrap)
            .component_div(&sigma);
        largest_sigmas = largest_sigmas.max(off.amax());
    });
    assert!(differences > 0, "no silence was met");
    assert!(
        largest_sigmas < 0.5,
        "{largest_sigmas} standard deviations apart"
    );
}

#[test]
fn the_products_step_gives_the_bits_of_algorithm_4() {
    for scenario in ["paper", "lossy", "one-way", "outliers"] {
        assert_eq!(
            differing_steps(scenario, 1000),
            Vec::<usize>::new(),
            "{scenario}"
        );
    }
}

#[test]
fn late_messages_are_put_in_their_place_to_the_last_bit() {
    assert_eq!(differing_steps("delayed", 1000), Vec::<usize>::new());
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let config = config("paper", &[Kind::Nb, Kind::Coloc, Kind::Ccl], 5, 10.0);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool");
        serde_json::to_string(&pool.install(|| run(&config))).expect("JSON")
    };
    let one = on(1);
    assert!(one.contains("\"coloc\""));
    assert_eq!(one, on(3));
}

#[test]
fn progress_ends_at_its_total() {
    let last = std::sync::Mutex::new(Vec::new());
    let config = config("paper", &[Kind::Sl, Kind::Coloc], 2, 60.0);
    evaluate(&config, &|progress| {
        last.lock().expect("no panic before").push(progress);
    })
    .expect("sensible");
    let reports = last.into_inner().expect("no panic before");
    assert!(reports.len() > 4);
    assert_eq!(
        reports.iter().map(|progress| progress.done).max(),
        Some(reports[0].total)
    );
}

#[test]
fn what_cannot_be_evaluated_is_refused() {
    let mut config = config("paper", &[], 1, 10.0);
    assert_eq!(
        evaluate(&config, &|_| ()).unwrap_err(),
        EvalError::Nothing("method")
    );
    config.methods = vec![Kind::Sl];
    config.scenario.fixes.robots = vec![7];
    assert_eq!(
        evaluate(&config, &|_| ()).unwrap_err(),
        EvalError::NoSuchRobot {
            robot: 8,
            robots: 5
        }
    );
}

#[test]
fn coloc_is_consistent_and_better_and_naive_bayes_is_neither() {
    let report = run(&config(
        "paper",
        &[Kind::Nb, Kind::SplitCi, Kind::Coloc, Kind::Ccl],
        4,
        300.0,
    ));
    let [nb, paper, coloc, ccl] = [0, 1, 2, 3].map(|method| &report.methods[method].robots);
    for robot in 0..5 {
        assert!(
            nb[robot].nees_outside > 0.3,
            "the control fails: {}",
            nb[robot].nees_outside
        );
        assert!(
            coloc[robot].nees_outside < 0.05 && paper[robot].nees_outside < 0.05,
            "R{}",
            robot + 1
        );
        assert!(
            coloc[robot]
                .inside_3_sigma
                .iter()
                .all(|share| *share > 0.99),
            "R{}",
            robot + 1
        );
        assert!(
            coloc[robot].rms_position < paper[robot].rms_position,
            "R{}",
            robot + 1
        );
        assert!(
            coloc[robot].rms_position < 2.0 * ccl[robot].rms_position,
            "R{}",
            robot + 1
        );
    }
    // The joint filter has the right model here, so its NEES is what theory says.
    assert!((2.0..4.2).contains(&ccl[4].nees), "{}", ccl[4].nees);
}

#[test]
fn one_way_help_makes_the_paper_overconfident_and_not_coloc() {
    let report = run(&config("one-way", &[Kind::SplitCi, Kind::Coloc], 4, 300.0));
    let nees = |method: usize| {
        report.methods[method].robots[1..]
            .iter()
            .map(|robot| robot.nees)
            .collect::<Vec<_>>()
    };
    assert!(nees(0).iter().all(|nees| *nees > 3.0), "{:?}", nees(0));
    assert!(nees(1).iter().all(|nees| *nees < 3.0), "{:?}", nees(1));
}
