//! Two threads that publish in bursts, at once.
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use coloc_shm_types::{Estimate, Group, GroupPage, Header, Publisher, RobotName, Space};
use coloc_tests::scene::own_group;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::ROBOT;

pub(crate) const THREADS: usize = 2;
/// The thread that writes a group's page.
pub(crate) const OPEN: usize = 0;
/// Messages of one thread in one burst.
const MOST: u64 = 48;

pub(crate) struct Publishing {
    threads: Vec<Thread>,
}

struct Thread {
    handle: JoinHandle<()>,
    go: Sender<()>,
    /// How many it has said by then.
    said: Receiver<u64>,
}

impl Publishing {
    pub(crate) fn start(space: &Space, seed: u64) -> Self {
        let threads = (0..THREADS).map(|number| Thread::start(space.clone(), number, seed));
        Self {
            threads: threads.collect(),
        }
    }

    /// One of each; how much each has said in all.
    pub(crate) fn burst(&mut self) -> [u64; THREADS] {
        self.threads.iter().for_each(|it| it.go.send(()).unwrap());
        let mut said = [0; THREADS];
        for (said, thread) in said.iter_mut().zip(&self.threads) {
            *said = thread.said.recv().unwrap();
        }
        said
    }

    /// Once they have left.
    pub(crate) fn end(self) {
        for Thread { handle, go, .. } in self.threads {
            drop(go);
            handle.join().unwrap();
        }
    }
}

impl Thread {
    fn start(space: Space, number: usize, seed: u64) -> Self {
        let (go, started) = channel();
        let (tell, said) = channel();
        let handle = std::thread::spawn(move || {
            let voice = Voice::new(&space, number);
            let mut random = ChaCha8Rng::seed_from_u64(seed ^ (number as u64 + 1));
            let mut count = 0;
            while started.recv().is_ok() {
                count += burst(&voice, number, count, &mut random);
                if tell.send(count).is_err() {
                    break;
                }
            }
        });
        Self { handle, go, said }
    }
}

struct Voice {
    page: Option<GroupPage>,
    publisher: Publisher<Estimate>,
}

impl Voice {
    fn new(space: &Space, number: usize) -> Self {
        let robot = RobotName::new(ROBOT).unwrap();
        let publisher = space.publisher(&robot).unwrap();
        let group = Group::find(&own_group()).unwrap();
        let page = (number == OPEN).then(|| publisher.open_to(&group, &robot, 1).unwrap());
        Self { page, publisher }
    }

    fn say(&self, header: Header) {
        let estimate = Estimate {
            header,
            ..Estimate::default()
        };
        if let Some(page) = &self.page {
            page.write(&estimate);
        }
        // Whoever was just killed is not reached.
        let _ = self.publisher.send(estimate);
    }
}

/// As fast as it can be, with pauses now and then in which readers fall asleep.
fn burst(voice: &Voice, number: usize, before: u64, random: &mut ChaCha8Rng) -> u64 {
    let count = random.random_range(1..=MOST);
    for sequence in 1..=count {
        let header = Header {
            source: u16::try_from(number).unwrap(),
            sequence: before + sequence,
            ..Header::default()
        };
        voice.say(header);
        if random.random_range(0..8) == 0 {
            spin(Duration::from_nanos(random.random_range(0..20_000)));
        }
    }
    count
}

fn spin(time: Duration) {
    let start = Instant::now();
    while start.elapsed() < time {
        std::hint::spin_loop();
    }
}
