//! A bad network in a box: a proxy for UDP that loses, delays, reorders and doubles packets, and can be cut, always in the same way for the same seed
//! and the same packets. For tests and for the demo; a robot never meets it.
use std::collections::BTreeMap;
use std::io;
use std::net::{SocketAddr, UdpSocket as Socket};
use std::rc::Rc;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tokio::net::UdpSocket;
use tokio::sync::{Notify, Semaphore};
use tokio::task::{LocalSet, spawn_local};

/// What becomes of packets, each way by itself.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Weather {
    /// This part of all packets is lost (0 to 1).
    pub loss: f64,
    /// The least and the most that a packet is late; each draws its own, so that they overtake one another (s).
    pub delay_s: [f64; 2],
    /// This part of all packets comes twice (0 to 1).
    pub doubled: f64,
    /// Nothing passes.
    pub cut: bool,
}

/// What a network has done.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Packets that came in.
    pub came: u64,
    /// Packets that went out.
    pub passed: u64,
}

/// A network that runs, until it is dropped.
#[derive(Debug)]
pub struct Cloud {
    address: SocketAddr,
    air: Arc<Air>,
    end: Arc<Notify>,
    thread: Option<JoinHandle<()>>,
}

/// What packets go through between two.
#[derive(Debug)]
pub(crate) struct Air(Mutex<State>);

#[derive(Debug)]
struct State {
    weather: Weather,
    random: ChaCha8Rng,
    tally: Tally,
}

/// Who calls through it, at most.
const CALLERS: usize = 256;
/// Packets that are late at once, at most.
pub(crate) const LATE: usize = 65_536;
/// No packet is larger (bytes).
pub(crate) const LARGEST: usize = 65_535;

impl Cloud {
    /// Begins to forward what comes to `listens` to `target` and back.
    ///
    /// # Errors
    /// If the address is taken, or there is no thread.
    pub fn open(
        listens: SocketAddr,
        target: SocketAddr,
        weather: Weather,
        seed: u64,
    ) -> io::Result<Self> {
        let front = Socket::bind(listens)?;
        front.set_nonblocking(true)?;
        let address = front.local_addr()?;
        let air = Arc::new(Air::new(weather, seed));
        let end = Arc::new(Notify::new());
        let (own, told) = (Arc::clone(&air), Arc::clone(&end));
        let thread = std::thread::Builder::new().name("weather".into());
        let thread = thread.spawn(move || {
            let runtime = tokio::runtime::Builder::new_current_thread()
                .enable_all()
                .build();
            // Without it nothing passes, which whoever waits for packets sees.
            if let Ok(runtime) = runtime {
                LocalSet::new().block_on(&runtime, async move {
                    let forwarding = spawn_local(forward(front, target, own));
                    told.notified().await;
                    forwarding.abort();
                });
            }
        })?;
        Ok(Self {
            address,
            air,
            end,
            thread: Some(thread),
        })
    }

    /// Where it is called.
    #[must_use]
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// Changes the weather.
    pub fn set(&self, weather: Weather) {
        self.air.set(weather);
    }

    /// What it has done so far.
    #[must_use]
    pub fn tally(&self) -> Tally {
        self.air.state().tally
    }
}

impl Drop for Cloud {
    fn drop(&mut self) {
        self.end.notify_one();
        // A thread that panicked has said so.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

impl Air {
    pub(crate) fn new(weather: Weather, seed: u64) -> Self {
        Self(Mutex::new(State {
            weather,
            random: ChaCha8Rng::seed_from_u64(seed),
            tally: Tally::default(),
        }))
    }

    pub(crate) fn set(&self, weather: Weather) {
        self.state().weather = weather;
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// By how much each copy of a packet is late.
    fn fate(&self) -> Vec<Duration> {
        let mut state = self.state();
        state.tally.came += 1;
        let Weather {
            loss,
            delay_s: [least_s, most_s],
            doubled,
            cut,
        } = state.weather;
        // The same numbers are drawn whatever the weather is, so that it alone makes the difference.
        let [lost, twice, first, second] = [(); 4].map(|()| state.random.random::<f64>());
        if cut || lost < loss {
            return Vec::new();
        }
        let late = |drawn: f64| {
            let late_s = (most_s - least_s).mul_add(drawn, least_s);
            Duration::try_from_secs_f64(late_s).unwrap_or_default()
        };
        let mut copies = vec![late(first)];
        copies.extend((twice < doubled).then(|| late(second)));
        state.tally.passed += copies.len() as u64;
        copies
    }

    /// Hands each copy of a packet that is not lost to `send`, when it is time. `late` has a place for each that waits.
    pub(crate) fn pass(
        &self,
        late: &Arc<Semaphore>,
        packet: &[u8],
        send: impl AsyncFn(Vec<u8>) + 'static,
    ) {
        let send = Rc::new(send);
        for delay in self.fate() {
            let Ok(place) = Arc::clone(late).try_acquire_owned() else {
                continue;
            };
            let (send, packet) = (Rc::clone(&send), packet.to_vec());
            spawn_local(async move {
                if !delay.is_zero() {
                    tokio::time::sleep(delay).await;
                }
                send(packet).await;
                drop(place);
            });
        }
    }
}

/// From callers to the target; each caller has a socket of its own to the target, as behind an address translator.
async fn forward(front: Socket, target: SocketAddr, air: Arc<Air>) {
    let Ok(front) = UdpSocket::from_std(front).map(Rc::new) else {
        return;
    };
    let late = Arc::new(Semaphore::new(LATE));
    let mut callers: BTreeMap<SocketAddr, Rc<UdpSocket>> = BTreeMap::new();
    let mut packet = vec![0; LARGEST];
    loop {
        let Ok((length, caller)) = front.recv_from(&mut packet).await else {
            continue;
        };
        if !callers.contains_key(&caller) {
            if callers.len() >= CALLERS {
                callers.clear();
            }
            let Some(back) = back(target).await else {
                continue;
            };
            spawn_local(answer(
                Rc::clone(&front),
                Rc::clone(&back),
                caller,
                Arc::clone(&air),
                Arc::clone(&late),
            ));
            callers.insert(caller, back);
        }
        if let (Some(back), Some(packet)) = (callers.get(&caller), packet.get(..length)) {
            let back = Rc::clone(back);
            air.pass(&late, packet, async move |packet| {
                let _ = back.send(&packet).await;
            });
        }
    }
}

async fn back(target: SocketAddr) -> Option<Rc<UdpSocket>> {
    let back = UdpSocket::bind("127.0.0.1:0").await.ok()?;
    back.connect(target).await.ok()?;
    Some(Rc::new(back))
}

/// From the target back to a caller.
async fn answer(
    front: Rc<UdpSocket>,
    back: Rc<UdpSocket>,
    caller: SocketAddr,
    air: Arc<Air>,
    late: Arc<Semaphore>,
) {
    let mut packet = vec![0; LARGEST];
    loop {
        // The target is not there: that is told to whoever sends next, and is no end.
        let Ok(length) = back.recv(&mut packet).await else {
            tokio::time::sleep(Duration::from_millis(1)).await;
            continue;
        };
        if let Some(packet) = packet.get(..length) {
            let front = Rc::clone(&front);
            air.pass(&late, packet, async move |packet| {
                let _ = front.send_to(&packet, caller).await;
            });
        }
    }
}
