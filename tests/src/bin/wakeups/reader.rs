//! Being a reader: sleeps, takes all that is there, says what the last of it was.
use std::error::Error;
use std::os::fd::{BorrowedFd, OwnedFd};
use std::path::Path;
use std::time::{Duration, Instant};

use coloc_shm_types::{Estimate, Odometry, Reader, RobotName, Space, Subscriber};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rustix::event::{PollFd, PollFlags, epoll, poll};
use rustix::io::Errno;
use rustix::process::{Signal, set_parent_process_death_signal};

use crate::publishing::THREADS;
use crate::{PATIENCE, PREFIX, ROBOT};

/// How it sleeps.
enum Way {
    Wait,
    Poll,
    Edges(OwnedFd),
}

/// One in so many leaves when it was woken so often at most, as a program does that has done its work.
const LEAVERS: u32 = 3;
const WAKE_UPS: u64 = 2000;

/// One in so many is in another user's place, and hears one thread.
const GUESTS: u32 = 4;

/// Whether the one with this number is.
pub(crate) const fn is_guest(number: u32) -> bool {
    number.is_multiple_of(GUESTS)
}

/// From where it hears.
enum Estimates {
    Channel(Subscriber<Estimate>),
    Page(Reader),
}

impl Estimates {
    fn open(number: u32, space: &Space, root: &Path) -> Result<Self, Box<dyn Error>> {
        let robot = RobotName::new(ROBOT)?;
        if !is_guest(number) {
            return Ok(Self::Channel(space.subscriber(&robot)?));
        }
        // The page may be opened just now.
        let start = Instant::now();
        loop {
            match Reader::open(root, &robot) {
                Ok(reader) => return Ok(Self::Page(reader)),
                Err(refusal) if start.elapsed() > PATIENCE => return Err(refusal.into()),
                Err(_) => std::thread::sleep(Duration::from_millis(1)),
            }
        }
    }

    fn receive(&self) -> Result<Option<Estimate>, Box<dyn Error>> {
        Ok(match self {
            Self::Channel(subscriber) => subscriber.receive()?,
            Self::Page(reader) => reader.receive()?,
        })
    }

    fn wait(&self, timeout: Duration) -> Result<Option<Estimate>, Box<dyn Error>> {
        Ok(match self {
            Self::Channel(subscriber) => subscriber.wait(timeout)?,
            Self::Page(reader) => reader.wait(timeout)?,
        })
    }

    fn bell(&self) -> Result<BorrowedFd<'_>, Box<dyn Error>> {
        Ok(match self {
            Self::Channel(subscriber) => subscriber.bell()?,
            Self::Page(reader) => reader.bell()?,
        })
    }
}

pub(crate) fn run(number: u32, root: &Path) -> Result<(), Box<dyn Error>> {
    set_parent_process_death_signal(Some(Signal::KILL))?;
    let space = Space::open(root, PREFIX, "reader")?;
    let robot = RobotName::new(ROBOT)?;
    let acknowledgements = space.publisher::<Odometry>(&robot)?;
    let estimates = Estimates::open(number, &space, root)?;
    let way = Way::of(number, &estimates)?;
    let mut random = ChaCha8Rng::seed_from_u64(number.into());
    let stays = !number.is_multiple_of(LEAVERS);
    let mut left = if stays {
        u64::MAX
    } else {
        random.random_range(1..WAKE_UPS)
    };
    let mut known = [0; THREADS];
    while left > 0 {
        while let Some(estimate) = estimates.receive()? {
            note(&estimate, &mut known);
        }
        let mut message = Odometry::default();
        message.header.stamp_ns = number.into();
        [message.header.session, message.header.sequence] = known;
        acknowledgements.send(message)?;
        way.sleep(&estimates, &mut known)?;
        left -= 1;
    }
    Ok(())
}

fn note(estimate: &Estimate, known: &mut [u64; THREADS]) {
    known[usize::from(estimate.header.source)] = estimate.header.sequence;
}

impl Way {
    fn of(number: u32, estimates: &Estimates) -> Result<Self, Box<dyn Error>> {
        Ok(match number / LEAVERS % 3 {
            0 => Self::Wait,
            1 => {
                estimates.bell()?;
                Self::Poll
            }
            _ => {
                let epoll = epoll::create(epoll::CreateFlags::CLOEXEC)?;
                let flags = epoll::EventFlags::IN | epoll::EventFlags::ET;
                let data = epoll::EventData::new_u64(0);
                epoll::add(&epoll, estimates.bell()?, data, flags)?;
                Self::Edges(epoll)
            }
        })
    }

    /// Nothing was found before.
    fn sleep(
        &self,
        estimates: &Estimates,
        known: &mut [u64; THREADS],
    ) -> Result<(), Box<dyn Error>> {
        match self {
            Self::Wait => {
                if let Some(estimate) = estimates.wait(2 * PATIENCE)? {
                    note(&estimate, known);
                }
            }
            Self::Poll => {
                let bell = estimates.bell()?;
                unless_interrupted(poll(&mut [PollFd::new(&bell, PollFlags::IN)], None))?;
            }
            Self::Edges(epoll) => {
                let mut events = Vec::with_capacity(1);
                let spare = rustix::buffer::spare_capacity(&mut events);
                unless_interrupted(epoll::wait(epoll, spare, None))?;
            }
        }
        Ok(())
    }
}

/// Who was stopped and goes on looks again.
fn unless_interrupted(woken: rustix::io::Result<usize>) -> rustix::io::Result<()> {
    match woken {
        Ok(_) | Err(Errno::INTR) => Ok(()),
        Err(error) => Err(error),
    }
}
