//! Two threads that publish in bursts, at once.
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use coloc_shm_types::{Estimate, Header, Publisher, RobotName, Space};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::ROBOT;

pub(crate) const THREADS: usize = 2;
/// Messages of one thread in one burst.
const MOST: u64 = 48;

pub(crate) struct Publishing {
    threads: Vec<Thread>,
}

struct Thread {
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
}

impl Thread {
    fn start(space: Space, number: usize, seed: u64) -> Self {
        let (go, started) = channel();
        let (tell, said) = channel();
        std::thread::spawn(move || {
            let publisher = space.publisher(&RobotName::new(ROBOT).unwrap()).unwrap();
            let mut random = ChaCha8Rng::seed_from_u64(seed ^ (number as u64 + 1));
            let mut count = 0;
            while started.recv().is_ok() {
                count += burst(&publisher, number, count, &mut random);
                if tell.send(count).is_err() {
                    break;
                }
            }
        });
        Self { go, said }
    }
}

/// As fast as it can be, with pauses now and then in which readers fall asleep.
fn burst(
    publisher: &Publisher<Estimate>,
    number: usize,
    before: u64,
    random: &mut ChaCha8Rng,
) -> u64 {
    let count = random.random_range(1..=MOST);
    for sequence in 1..=count {
        let header = Header {
            source: u16::try_from(number).unwrap(),
            sequence: before + sequence,
            ..Header::default()
        };
        // Whoever was just killed is not reached.
        let _ = publisher.send(Estimate {
            header,
            ..Estimate::default()
        });
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
