//! The link at work: one thread, on which tasks take turns.
//!
//! ```text
//! shared memory ─ ears ─► seal ─► a queue for each member ─ budget ─► QUIC
//! shared memory ◄─ mouths ◄─ admission ◄──────────────────────────── QUIC
//! ```
//!
//! All that they share is an [`Office`], which no task holds while it waits.

mod board;
mod calls;
mod company;
mod counts;
mod discover;
mod lines;
mod motion;
mod office;
mod report;
mod rosters;
mod send;
mod take;
mod watch;

use std::cell::RefCell;
use std::io;
use std::os::fd::AsFd;
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;

use coloc_sensors::{EndError, Stop};
use tokio::net::UnixStream;
use tokio::task::{LocalSet, spawn_local};

use crate::engine::{Door, Engine};
use crate::tls::Members;

pub(crate) use board::{WRONG, ask};
pub use counts::{Counts, FIGURES, REASONS};
pub use office::{Office, Papers};
pub use rosters::Team;

/// From one look after everything to the next.
const SECOND: Duration = Duration::from_secs(1);

/// Runs the link until it is asked to end.
///
/// # Errors
/// Why it could not begin or go on.
pub fn run(office: Office, stop: &Stop) -> Result<(), EndError> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .map_err(EndError::of("there is no runtime"))?;
    LocalSet::new().block_on(&runtime, serve(office, stop))
}

async fn serve(office: Office, stop: &Stop) -> Result<(), EndError> {
    let members: Arc<dyn Members> = office.team();
    let opened = Engine::open(office.listens_on(), office.identity(), &members);
    let engine = opened.map_err(|error| EndError::Input(error.to_string()))?;
    let door = Door::default();
    let office = Rc::new(RefCell::new(office));
    office
        .borrow_mut()
        .begin(door.clone(), engine.address().ok());
    spawn_local(lines::answer(Rc::clone(&office), engine.clone(), door));
    spawn_local(calls::call_all(Rc::clone(&office), engine.clone()));
    spawn_local(send::tell_clocks(Rc::clone(&office)));
    spawn_local(board::answer(Rc::clone(&office)));
    if let (true, Ok(address)) = (office.borrow().section.discover, engine.address()) {
        spawn_local(discover::discover(Rc::clone(&office), address));
    }
    let ended = look_after(&office, stop).await;
    engine.close().await;
    office.borrow_mut().finish();
    ended
}

/// Once a second, until the end.
async fn look_after(office: &Rc<RefCell<Office>>, stop: &Stop) -> Result<(), EndError> {
    let asked = asked(stop).map_err(EndError::of("it cannot be waited"))?;
    loop {
        watch::listen(office).await?;
        office.borrow_mut().second()?;
        if tokio::time::timeout(SECOND, asked.readable()).await.is_ok() {
            return Ok(());
        }
    }
}

/// Readable once it is asked to end.
fn asked(stop: &Stop) -> io::Result<UnixStream> {
    let asked = std::os::unix::net::UnixStream::from(stop.as_fd().try_clone_to_owned()?);
    asked.set_nonblocking(true)?;
    UnixStream::from_std(asked)
}
