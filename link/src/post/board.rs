//! What a link knows of its peers, for whoever asks on its own computer: `coloc-link check`, which cannot ask the peers themselves without
//! being taken for this link.
use std::cell::RefCell;
use std::fmt::Write as _;
use std::fs::Permissions;
use std::io::{self, Read};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixStream as Asking;
use std::path::Path;
use std::rc::Rc;
use std::time::Duration;

use tokio::net::UnixListener;

use super::office::Office;
use crate::admission::Peer;
use crate::wire::Hello;

/// In the robot's own directory.
const SOCKET: &str = "link.socket";
/// Begins a line about something that is not as it should be.
pub(crate) const WRONG: char = '!';
/// Nobody has so many peers (bytes).
const LONGEST: u64 = 1 << 20;
const PATIENCE: Duration = Duration::from_secs(2);

/// Answers whoever asks, until the end.
pub(super) async fn answer(office: Rc<RefCell<Office>>) {
    let place = office.borrow().directory.join(SOCKET);
    let listener = match open(&place) {
        Ok(listener) => listener,
        Err(error) => {
            let text = format!("it cannot be asked at {}: {error}", place.display());
            return office.borrow_mut().teller.remark(text);
        }
    };
    loop {
        let Ok((asking, _)) = listener.accept().await else {
            tokio::time::sleep(PATIENCE).await;
            continue;
        };
        let text = office.borrow().board();
        // The socket holds all of it, or who asks has gone.
        let _ = asking.try_write(text.as_bytes());
    }
}

/// What is there is of a link that has ended: no two of one robot run at once.
fn open(place: &Path) -> io::Result<UnixListener> {
    match std::fs::remove_file(place) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    let listener = UnixListener::bind(place)?;
    std::fs::set_permissions(place, Permissions::from_mode(0o600))?;
    Ok(listener)
}

/// A line for each other member, of its name and what is known, after [`WRONG`] if that is not as it should be; `None` if no link runs.
pub(crate) fn ask(directory: &Path) -> Option<String> {
    let asking = Asking::connect(directory.join(SOCKET)).ok()?;
    asking.set_read_timeout(Some(PATIENCE)).ok()?;
    let mut text = String::new();
    asking.take(LONGEST).read_to_string(&mut text).ok()?;
    Some(text)
}

impl Office {
    fn board(&self) -> String {
        let roster = self.roster();
        let mut text = String::new();
        for member in roster.member.iter().filter(|it| it.id != self.own) {
            let is_here = self.members.contains_key(&member.id);
            let peer = self.admission.peer(member.id).filter(|_| is_here);
            let (is_wrong, mut known) = self.known(peer);
            let found = self.found.of(member.id).iter().map(ToString::to_string);
            let found = found.collect::<Vec<_>>().join(", ");
            if !found.is_empty() {
                known.push_str("; multicast DNS has found it at ");
                known.push_str(&found);
            }
            let sign = if is_wrong {
                WRONG.to_string()
            } else {
                String::new()
            };
            // It cannot fail: it is a string.
            let _ = writeln!(text, "{sign}{}: {known}", member.name);
        }
        text
    }

    fn known(&self, peer: Option<&Peer>) -> (bool, String) {
        let Some((peer, hello)) = peer.and_then(|peer| Some((peer, peer.hello()?))) else {
            return (false, "is not connected to the link that runs here".into());
        };
        let is_understood = hello.common_version(self.versions()).is_some();
        let offset = peer.offset();
        let is_refused = !self.section.correct_offset
            && offset.is_some_and(|it| it.exceeds(self.section.max_offset_s));
        let is_unset = hello.flags & Hello::CLOCK_UNSET != 0;
        let clock = offset.map_or_else(
            || "its clock is not known yet".into(),
            |it| {
                format!(
                    "its clock is {:+.3} ± {:.3} ms off and gains {:+.1} ± {:.1} ppm",
                    1e3 * it.offset_s,
                    1e3 * it.within_s,
                    1e6 * it.drift,
                    1e6 * it.drift_within
                )
            },
        );
        let program = hello
            .program()
            .unwrap_or("of a version that it does not say");
        let mut known = format!(
            "runs coloc-link {program}, wire {} to {}, roster {}; {clock}",
            hello.oldest,
            hello.newest,
            peer.roster()
        );
        for (is_so, what) in [
            (!is_understood, "; no version of the wire is common"),
            (is_unset, "; it says itself that its clock was never set"),
            (
                is_refused,
                "; that is more than link.max_offset_s: it is not heard",
            ),
        ] {
            if is_so {
                known.push_str(what);
            }
        }
        (!is_understood || is_unset || is_refused, known)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn where_no_link_runs_nobody_answers() {
        let home = tempfile::tempdir().unwrap();
        assert_eq!(ask(home.path()), None);
    }
}
