//! What `coloc demo --fleet` needs beside the links themselves: the roster of a team on one computer whose keys everybody can make, and the
//! bad network between its members.
use std::cell::Cell;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clap::Args;
use coloc_sensors::stop::Woken;
use coloc_sensors::{EndError, Moment as Present, Stop};
use coloc_shm_types::RobotName;
use coloc_shm_types::private::OwnFile;
use rustix::process::{Signal, getppid, set_parent_process_death_signal};
use signal_hook::consts::{SIGUSR1, SIGUSR2};
use tokio::task::LocalSet;

use crate::keys::Identity;
use crate::networks::{Between, Network};
use crate::roster::{FORMAT, Member, Moment, Role, Roster};
use crate::weather::{Cloud, Weather};

/// A team on one computer.
#[derive(Debug, Args)]
pub struct RosterArgs {
    /// Where to write its roster.
    file: PathBuf,
    /// Its members, each `name=number@address`.
    members: Vec<String>,
}

/// How bad a network is. SIGUSR1 cuts it, SIGUSR2 mends it.
#[derive(Debug, Args)]
struct Bad {
    /// This part of all packets is lost.
    #[arg(long, default_value_t = 0.0)]
    loss: f64,
    /// The most that a packet is late (ms).
    #[arg(long, default_value_t = 0.0)]
    delay_ms: f64,
    /// Of all that is random.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// A network between members on one computer.
#[derive(Debug, Args)]
pub struct WeatherArgs {
    #[command(flatten)]
    bad: Bad,
    /// What comes to one address goes to another, each `address=address`.
    ways: Vec<String>,
}

/// A network namespace for each member, and a network between them.
#[derive(Debug, Args)]
pub struct NetworksArgs {
    #[command(flatten)]
    bad: Bad,
    /// The addresses of each, `address,address`.
    members: Vec<String>,
}

/// The demo's process number, if it started this one.
const DEMO: &str = "COLOC_DEMO_PID";
/// So long is such a team one (s).
const DAY: i64 = 86_400;
const LOOK: Duration = Duration::from_millis(20);
const NO_NETWORKS: &str = "the networks cannot be made";
const NO_SIGNALS: &str = "signals cannot be handled";
/// Begins a line with where a namespace is.
const NETWORK: &str = "network ";

/// Writes the roster of a team whose keys everybody can make.
///
/// # Errors
/// If a member cannot be understood, or the file not be written.
pub fn write_roster(args: &RosterArgs) -> Result<(), EndError> {
    let now = Moment::of_ns(Present::now().realtime_ns);
    let members = args.members.iter().map(|text| member(text, now));
    let member = members.collect::<Option<Vec<_>>>();
    let misunderstood = || EndError::Input("members are name=number@address".into());
    let team = Identity::insecure(0);
    let roster = Roster {
        format: FORMAT,
        version: 1,
        name: "rehearsal".into(),
        team: team.public(),
        issued: now,
        datum: "rehearsal".into(),
        periods: std::collections::BTreeMap::new(),
        leaders: Vec::new(),
        member: member.ok_or_else(misunderstood)?,
    };
    let text = roster.sign(&team);
    let text = text.map_err(|error| EndError::Input(error.to_string()))?;
    write(&args.file, &text)
}

fn write(path: &Path, text: &str) -> Result<(), EndError> {
    Ok(OwnFile::named(path)?.replace(text.as_bytes())?)
}

fn member(text: &str, now: Moment) -> Option<Member> {
    let (name, rest) = text.split_once('=')?;
    let (id, address) = rest.split_once('@')?;
    let id = id.parse().ok()?;
    Some(Member {
        name: RobotName::new(name).ok()?,
        id,
        role: Role::Robot,
        key: Identity::insecure(id).public(),
        next_key: None,
        expires: now.later(DAY),
        addresses: vec![address.into()],
        says: None,
    })
}

/// Makes the weather until it is asked to end.
///
/// # Errors
/// If an address cannot be understood or had.
pub fn make_weather(args: &WeatherArgs) -> Result<(), EndError> {
    let sky = Sky::over(&args.bad)?;
    let mut clouds = Vec::new();
    for (way, seed) in args.ways.iter().zip(args.bad.seed..) {
        let ends = way.split_once('=');
        let ends = ends.and_then(|(from, to)| Some((from.parse().ok()?, to.parse().ok()?)));
        let misunderstood = || EndError::Input(format!("{way:?} is not address=address"));
        let (listens, target) = ends.ok_or_else(misunderstood)?;
        let cloud = Cloud::open(listens, target, sky.fair, seed);
        clouds.push(cloud.map_err(EndError::of("the network cannot be made"))?);
    }
    say("ready")?;
    while let Some(weather) = sky.after(LOOK)? {
        for cloud in &clouds {
            cloud.set(weather);
        }
    }
    Ok(())
}

/// Makes the namespaces, says where each is, and carries what goes between them until it is asked to end.
///
/// # Errors
/// If an address cannot be understood, or this user may not make them.
pub fn make_networks(args: &NetworksArgs) -> Result<(), EndError> {
    let sky = Sky::over(&args.bad)?;
    let mut networks = Vec::new();
    for member in &args.members {
        let addresses: Result<Vec<_>, _> = member.split(',').map(str::parse).collect();
        let misunderstood = |_| EndError::Input(format!("{member:?} is not address,address"));
        let network = Network::make(&addresses.map_err(misunderstood)?);
        networks.push(network.map_err(EndError::of(NO_NETWORKS))?);
    }
    for network in &networks {
        say(&format!("{NETWORK}{}", network.place()))?;
    }
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .map_err(EndError::of("there is no runtime"))?;
    LocalSet::new().block_on(&runtime, async {
        let between = Between::open(networks, sky.fair, args.bad.seed);
        let between = between.map_err(EndError::of(NO_NETWORKS))?;
        say("ready")?;
        while let Some(weather) = sky.after(Duration::ZERO)? {
            between.set(weather);
            tokio::time::sleep(LOOK).await;
        }
        Ok(())
    })
}

/// The weather, as signals change it.
struct Sky {
    stop: Stop,
    fair: Weather,
    /// Asked to cut, and to mend.
    told: [Arc<AtomicBool>; 2],
    cut: Cell<bool>,
}

impl Sky {
    fn over(bad: &Bad) -> Result<Self, EndError> {
        let stop = Stop::on_signals().map_err(EndError::of(NO_SIGNALS))?;
        let told: [Arc<AtomicBool>; 2] = Default::default();
        for (told, signal) in told.iter().zip([SIGUSR1, SIGUSR2]) {
            let registered = signal_hook::flag::register(signal, Arc::clone(told));
            registered.map_err(EndError::of(NO_SIGNALS))?;
        }
        let fair = Weather {
            loss: bad.loss,
            delay_s: [0.0, bad.delay_ms / 1e3],
            ..Weather::default()
        };
        Ok(Self {
            stop,
            fair,
            told,
            cut: Cell::new(false),
        })
    }

    /// Waits so long. The weather as it is then; nothing once it is asked to end.
    fn after(&self, patience: Duration) -> Result<Option<Weather>, EndError> {
        let woken = self.stop.wait(None, patience);
        if woken.map_err(EndError::of("it cannot be waited"))? == Woken::Stop {
            return Ok(None);
        }
        let [cut, mend] = self
            .told
            .each_ref()
            .map(|it| it.swap(false, Ordering::Relaxed));
        self.cut.set((self.cut.get() || cut) && !mend);
        Ok(Some(Weather {
            cut: self.cut.get(),
            ..self.fair
        }))
    }
}

/// Has the kernel end this process with the demo that started it, even if that is killed.
///
/// # Errors
/// If the kernel does not, or the demo has ended already.
pub fn end_with_the_demo() -> Result<(), EndError> {
    let Some(demo) = std::env::var_os(DEMO) else {
        return Ok(());
    };
    let followed = set_parent_process_death_signal(Some(Signal::TERM));
    followed.map_err(|error| EndError::of("the demo cannot be followed")(error.into()))?;
    // It may have ended before the line above; then nobody will send the signal.
    let parent = getppid().map(|pid| pid.as_raw_nonzero().to_string());
    if parent.is_some_and(|parent| demo == *parent) {
        return Ok(());
    }
    Err(EndError::Input("the demo that started it has ended".into()))
}

fn say(text: &str) -> Result<(), EndError> {
    let mut out = io::stdout();
    let said = writeln!(out, "{text}").and_then(|()| out.flush());
    said.map_err(EndError::of("standard output cannot be written"))
}
