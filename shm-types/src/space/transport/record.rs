//! What iceoryx2 keeps in small files below the root: what a service is, who takes part, which ports they have.
//!
//! The files are those of iceoryx2's `static_storage::file`; but one whose content is known is complete when it appears.
#![expect(unsafe_code, reason = "iceoryx2's traits ask for it")]

use core::ptr::NonNull;
use core::time::Duration;
use std::fs::File;
use std::io::{ErrorKind, Write};
use std::os::fd::AsFd;
use std::os::unix::fs::DirBuilderExt;
use std::path::PathBuf;

use iceoryx2::prelude::SemanticString;
use iceoryx2_bb_elementary_traits::testing::abandonable::Abandonable;
use iceoryx2_cal::named_concept::{
    FileName, NamedConcept, NamedConceptBuilder, NamedConceptConfiguration,
    NamedConceptDoesExistError, NamedConceptListError, NamedConceptMgmt,
    NamedConceptPathHintRemoveError, NamedConceptRemoveError, Path,
};
use iceoryx2_cal::static_storage::file::{self as stock, Configuration};
use iceoryx2_cal::static_storage::{
    StaticStorage, StaticStorageBuilder, StaticStorageCreateError as CreateError,
    StaticStorageLocked, StaticStorageOpenError as OpenError, StaticStorageReadError as ReadError,
    StaticStorageUnlockError as UnlockError,
};
use rustix::fs::{FallocateFlags, Mode, OFlags};
use rustix::io::Errno;

use super::fault::{Site, note};
use super::unfinished::Unfinished;

/// iceoryx2 takes a file of this mode for complete.
const COMPLETE: Mode = Mode::RUSR;

/// Of the file by which a node says that it uses a service.
const SERVICE_TAG: &str = ".service_tag";

/// iceoryx2's `static_storage`.
#[derive(Debug)]
pub(crate) struct Storage(stock::Storage);

/// One that has its name, and no content yet.
#[derive(Debug)]
pub(crate) struct Locked(stock::Locked);

impl Abandonable for Storage {
    unsafe fn abandon_in_place(mut this: NonNull<Self>) {
        // SAFETY: the caller's promise is handed on.
        unsafe { stock::Storage::abandon_in_place(NonNull::from(&mut this.as_mut().0)) }
    }
}

impl Abandonable for Locked {
    unsafe fn abandon_in_place(mut this: NonNull<Self>) {
        // SAFETY: the caller's promise is handed on.
        unsafe { stock::Locked::abandon_in_place(NonNull::from(&mut this.as_mut().0)) }
    }
}

impl NamedConcept for Storage {
    fn name(&self) -> &FileName {
        self.0.name()
    }
}

impl NamedConcept for Locked {
    fn name(&self) -> &FileName {
        self.0.name()
    }
}

impl NamedConceptMgmt for Storage {
    type Configuration = Configuration;

    fn does_exist_cfg(
        name: &FileName,
        config: &Configuration,
    ) -> Result<bool, NamedConceptDoesExistError> {
        stock::Storage::does_exist_cfg(name, config)
    }

    fn list_cfg(config: &Configuration) -> Result<Vec<FileName>, NamedConceptListError> {
        stock::Storage::list_cfg(config)
    }

    /// True also if it was gone: where iceoryx2 hears that a dead port's tag is gone, because whoever cleaned up before
    /// was killed too, it would leave the port its place for ever.
    ///
    /// A service's tag goes with its node's directory. iceoryx2 removes it before it gives back the node's place in the
    /// service; who was killed in between would keep that for ever, as nobody knows of it any more.
    unsafe fn remove_cfg(
        name: &FileName,
        config: &Configuration,
    ) -> Result<bool, NamedConceptRemoveError> {
        if config.get_suffix().as_bytes() == SERVICE_TAG.as_bytes() {
            return Ok(true);
        }
        // SAFETY: the caller's promise is handed on.
        unsafe { stock::Storage::remove_cfg(name, config) }.map(|_| true)
    }

    /// iceoryx2 asks for it when a node is gone and all its ports are. Tags of ports that were killed while they were
    /// made would still be in it, and then neither it nor the node could ever be removed.
    fn remove_path_hint(path: &Path) -> Result<(), NamedConceptPathHintRemoveError> {
        match std::fs::remove_dir_all(path.to_string()) {
            Err(error) if error.kind() != ErrorKind::NotFound => {
                Err(NamedConceptPathHintRemoveError::InternalError)
            }
            _ => Ok(()),
        }
    }
}

impl StaticStorage for Storage {
    type Builder = Builder;
    type Locked = Locked;

    fn len(&self) -> u64 {
        self.0.len()
    }

    fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    fn read(&self, content: &mut [u8]) -> Result<(), ReadError> {
        self.0.read(content)
    }

    fn release_ownership(&self) {
        self.0.release_ownership();
    }

    fn acquire_ownership(&self) {
        self.0.acquire_ownership();
    }
}

impl StaticStorageLocked<Storage> for Locked {
    fn unlock(self, contents: &[u8]) -> Result<Storage, UnlockError> {
        let unlocked = self.0.unlock(contents);
        if matches!(unlocked, Err(UnlockError::NoSpaceLeft)) {
            note(Site::Root)(Errno::NOSPC);
        }
        unlocked.map(Storage)
    }
}

/// Opens or makes a [`Storage`].
#[derive(Debug)]
pub(crate) struct Builder {
    name: FileName,
    config: Configuration,
    owned: bool,
}

impl NamedConceptBuilder<Storage> for Builder {
    fn new(name: &FileName) -> Self {
        Self {
            name: *name,
            config: Configuration::default(),
            owned: true,
        }
    }

    fn config(mut self, config: &Configuration) -> Self {
        self.config = config.clone();
        self
    }
}

impl StaticStorageBuilder<Storage> for Builder {
    fn has_ownership(mut self, value: bool) -> Self {
        self.owned = value;
        self
    }

    fn create(self, contents: &[u8]) -> Result<Storage, CreateError> {
        let written = self.make_directory().and_then(|()| self.write(contents));
        written.map_err(note(Site::Root)).map_err(explain)?;
        // What was just written is complete: there is nothing to wait for.
        let opened = self.stock().open(Duration::ZERO).map(Storage);
        opened.map_err(|_| CreateError::InternalError)
    }

    fn create_locked(self) -> Result<Locked, CreateError> {
        self.make_directory()
            .map_err(note(Site::Root))
            .map_err(explain)?;
        let path = self.path();
        let locked = match self.stock().create_locked() {
            Ok(locked) => locked,
            Err(CreateError::Creation) => return Err(ask_why(path)),
            Err(error) => return Err(error),
        };
        // If it does not succeed, `locked` removes the file.
        reserve(&path).map_err(note(Site::Root)).map_err(explain)?;
        Ok(Locked(locked))
    }

    fn open(self, timeout: Duration) -> Result<Storage, OpenError> {
        self.stock().open(timeout).map(Storage)
    }
}

impl Builder {
    fn stock(&self) -> stock::Builder {
        stock::Builder::new(&self.name)
            .config(&self.config)
            .has_ownership(self.owned)
    }

    fn path(&self) -> PathBuf {
        self.config.path_for(&self.name).to_string().into()
    }

    fn make_directory(&self) -> Result<(), Errno> {
        let directory = self.config.get_path_hint().to_string();
        std::fs::DirBuilder::new()
            .recursive(true)
            .mode(0o750)
            .create(directory)
            .map_err(|error| Errno::from_io_error(&error).unwrap_or(Errno::IO))
    }

    fn write(&self, contents: &[u8]) -> Result<(), Errno> {
        let unfinished = Unfinished::new(self.path())?;
        let file = unfinished.as_fd().try_clone_to_owned().map_err(errno)?;
        write_all(File::from(file), contents)?;
        unfinished.publish(COMPLETE)
    }
}

/// iceoryx2 does not say why a file could not be made; the kernel does, if it is asked the same.
fn ask_why(path: PathBuf) -> CreateError {
    match Unfinished::new(path).map_err(note(Site::Root)) {
        Ok(_) => CreateError::Creation,
        Err(error) => explain(error),
    }
}

/// Takes the room for the content of a service's description. If it were missing later, iceoryx2 would try again with what
/// it has half made, and panic.
fn reserve(path: &PathBuf) -> Result<(), Errno> {
    const EMPTY: [u8; 4096] = [b'\n'; 4096];
    let room = EMPTY.len() as u64;
    let flags = OFlags::WRONLY | OFlags::NOFOLLOW | OFlags::CLOEXEC;
    let file = rustix::fs::open(path, flags, Mode::empty())?;
    let reserve = || rustix::fs::fallocate(&file, FallocateFlags::KEEP_SIZE, 0, room);
    match rustix::io::retry_on_intr(reserve) {
        // Where that is unknown, empty lines behind the content do the same.
        Err(Errno::OPNOTSUPP) => write_all(File::from(file), &EMPTY),
        result => result,
    }
}

fn write_all(mut file: File, bytes: &[u8]) -> Result<(), Errno> {
    file.write_all(bytes).map_err(errno)
}

#[expect(clippy::needless_pass_by_value, reason = "for map_err")]
fn errno(error: std::io::Error) -> Errno {
    Errno::from_io_error(&error).unwrap_or(Errno::IO)
}

fn explain(error: Errno) -> CreateError {
    match error {
        Errno::EXIST => CreateError::AlreadyExists,
        Errno::ACCESS | Errno::PERM | Errno::ROFS => CreateError::InsufficientPermissions,
        Errno::NOSPC | Errno::DQUOT => CreateError::Write,
        _ => CreateError::Creation,
    }
}
