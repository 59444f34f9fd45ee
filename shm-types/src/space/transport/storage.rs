//! What iceoryx2 keeps in a segment: a value of type `T`, and room behind it.
//!
//! The bytes are those of iceoryx2's `posix_shared_memory::Storage`, and so are the names.
#![expect(
    unsafe_code,
    reason = "a value in memory that other processes map as well"
)]

use core::fmt::Debug;
use core::ptr::NonNull;
use core::time::Duration;
use std::marker::PhantomData;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use iceoryx2_bb_elementary::package_version::PackageVersion;
use iceoryx2_bb_elementary_traits::testing::abandonable::Abandonable;
use iceoryx2_bb_memory::bump_allocator::BumpAllocator;
use iceoryx2_bb_posix::access_mode::AccessMode;
use iceoryx2_cal::dynamic_storage::posix_shared_memory::{self as stock, Configuration};
use iceoryx2_cal::dynamic_storage::{
    DynamicStorage, DynamicStorageBuilder, DynamicStorageCreateError as CreateError,
    DynamicStorageOpenError as OpenError, DynamicStorageOpenOrCreateError as OpenOrCreateError,
    Initializer,
};
use iceoryx2_cal::named_concept::{
    FileName, NamedConcept, NamedConceptBuilder, NamedConceptConfiguration,
    NamedConceptDoesExistError, NamedConceptListError, NamedConceptMgmt,
    NamedConceptPathHintRemoveError, NamedConceptRemoveError, Path,
};
use rustix::io::Errno;

use super::fault::{Site, note};
use super::segment::{Draft, Refusal, Segment, path};

/// Others create and remove what is opened or created here: so often is it tried.
const TRIES: usize = 8;

/// The unit of [`Data::pages`] (bytes).
const PAGE: usize = 4096;

/// The first bytes of a segment.
///
/// `pages` lies where iceoryx2's own `Data` has padding, which is zero: there the length is not known.
#[repr(C)]
struct Data<T> {
    /// Of iceoryx2; zero until the rest is there.
    version: AtomicU64,
    drops: u8,
    /// Length of the whole, little-endian: what is shorter was cut off.
    pages: [u8; 3],
    value: T,
}

impl<T> Data<T> {
    /// Before `value`, a bool and the padding behind it have to have had the room of `drops` and `pages`.
    const FITS: () = assert!(align_of::<T>() >= 4);
}

/// Whether a segment that begins so, and is so long, can be used.
///
/// The first bytes of [`Data`], whatever `T` is: version, drops, pages.
pub(crate) fn is_complete(beginning: &[u8], length: u64) -> bool {
    let Some((&[version @ .., _, a, b, c], _)) = beginning.split_first_chunk::<12>() else {
        return false;
    };
    let pages = u32::from_le_bytes([a, b, c, 0]);
    version != [0; 8] && length >= u64::from(pages) * PAGE as u64
}

/// iceoryx2's `dynamic_storage` on a [`Segment`].
#[derive(Debug)]
pub(crate) struct Storage<T: Debug + Send + Sync> {
    segment: Segment,
    name: FileName,
    file: FileName,
    owned: AtomicBool,
    value: PhantomData<T>,
}

// SAFETY: it gives out shared references alone, to a `T` that threads may share.
unsafe impl<T: Debug + Send + Sync> Send for Storage<T> {}
// SAFETY: as above.
unsafe impl<T: Debug + Send + Sync> Sync for Storage<T> {}

impl<T: Debug + Send + Sync> Storage<T> {
    fn data(&self) -> NonNull<Data<T>> {
        self.segment.base().cast()
    }
}

impl<T: Debug + Send + Sync> Drop for Storage<T> {
    fn drop(&mut self) {
        if !*self.owned.get_mut() {
            return;
        }
        // SAFETY: it was checked to be complete when it was opened or made; iceoryx2 gives the ownership to the last user.
        unsafe {
            let data = self.data().as_mut();
            if data.drops != 0 {
                core::ptr::drop_in_place(&raw mut data.value);
            }
        }
        // Who has removed it before has done what was to be done; there may be another one of its name by now.
        let path = path(&self.file);
        if self.segment.is_at(&path) {
            let _ = rustix::fs::unlink(path);
        }
    }
}

impl<T: Debug + Send + Sync> Abandonable for Storage<T> {
    unsafe fn abandon_in_place(mut this: NonNull<Self>) {
        // SAFETY: the caller promises that it is valid, and that nobody uses or drops it afterwards.
        unsafe {
            *this.as_mut().owned.get_mut() = false;
            core::ptr::drop_in_place(this.as_ptr());
        }
    }
}

impl<T: Debug + Send + Sync> NamedConcept for Storage<T> {
    fn name(&self) -> &FileName {
        &self.name
    }
}

impl<T: Debug + Send + Sync> NamedConceptMgmt for Storage<T> {
    type Configuration = Configuration<T>;

    fn does_exist_cfg(
        name: &FileName,
        config: &Self::Configuration,
    ) -> Result<bool, NamedConceptDoesExistError> {
        stock::Storage::does_exist_cfg(name, config)
    }

    fn list_cfg(config: &Self::Configuration) -> Result<Vec<FileName>, NamedConceptListError> {
        stock::Storage::list_cfg(config)
    }

    unsafe fn remove_cfg(
        name: &FileName,
        config: &Self::Configuration,
    ) -> Result<bool, NamedConceptRemoveError> {
        // SAFETY: the caller's promise is handed on.
        unsafe { stock::Storage::remove_cfg(name, config) }
    }

    fn remove_path_hint(path: &Path) -> Result<(), NamedConceptPathHintRemoveError> {
        stock::Storage::<T>::remove_path_hint(path)
    }
}

impl<T: Debug + Send + Sync> DynamicStorage<T> for Storage<T> {
    type Builder<'builder> = Builder<'builder, T>;

    fn does_support_persistency() -> bool {
        true
    }

    fn has_ownership(&self) -> bool {
        self.owned.load(Ordering::Relaxed)
    }

    fn release_ownership(&self) {
        self.owned.store(false, Ordering::Relaxed);
    }

    fn acquire_ownership(&self) {
        self.owned.store(true, Ordering::Relaxed);
    }

    fn get(&self) -> &T {
        // SAFETY: it was checked to be complete when it was opened or made, and is mapped for as long as this lives.
        unsafe { &self.data().as_ref().value }
    }

    unsafe fn __internal_set_type_name_in_config(config: &mut Self::Configuration, name: &str) {
        // SAFETY: the caller's promise is handed on.
        unsafe { stock::Storage::__internal_set_type_name_in_config(config, name) }
    }
}

/// Opens or makes a [`Storage`].
#[derive(Debug)]
pub(crate) struct Builder<'builder, T: Debug + Send + Sync> {
    name: FileName,
    config: Configuration<T>,
    drops: bool,
    supplement: usize,
    owned: bool,
    initializer: Initializer<'builder, T>,
}

impl<T: Debug + Send + Sync> NamedConceptBuilder<Storage<T>> for Builder<'_, T> {
    fn new(name: &FileName) -> Self {
        Self {
            name: *name,
            config: Configuration::default(),
            drops: true,
            supplement: 0,
            owned: true,
            initializer: Initializer::new(|_, _| true),
        }
    }

    fn config(mut self, config: &Configuration<T>) -> Self {
        self.config = config.clone();
        self
    }
}

impl<'builder, T: Debug + Send + Sync> DynamicStorageBuilder<'builder, T, Storage<T>>
    for Builder<'builder, T>
{
    fn call_drop_on_destruction(mut self, value: bool) -> Self {
        self.drops = value;
        self
    }

    fn has_ownership(mut self, value: bool) -> Self {
        self.owned = value;
        self
    }

    fn supplementary_size(mut self, value: usize) -> Self {
        self.supplement = value;
        self
    }

    /// Nothing here waits: what is half-made is refused at once, and whoever has time tries again.
    fn timeout(self, _: Duration) -> Self {
        self
    }

    fn initializer<F: FnMut(&mut T, &mut BumpAllocator) -> bool + 'builder>(
        mut self,
        value: F,
    ) -> Self {
        self.initializer = Initializer::new(value);
        self
    }

    fn create(mut self, value: T) -> Result<Storage<T>, CreateError> {
        let draft = self.draft(value)?;
        self.publish(draft).map_err(|(_, error)| error)
    }

    fn open(self, access: AccessMode) -> Result<Storage<T>, OpenError> {
        self.open_once(access)
    }

    fn open_or_create(mut self, value: T) -> Result<Storage<T>, OpenOrCreateError> {
        match self.open_once(AccessMode::ReadWrite) {
            Err(OpenError::DoesNotExist) => {}
            result => return Ok(result?),
        }
        let mut draft = self.draft(value)?;
        for _ in 0..TRIES {
            draft = match self.publish(draft) {
                Err((draft, CreateError::AlreadyExists)) => draft,
                result => return Ok(result.map_err(|(_, error)| error)?),
            };
            match self.open_once(AccessMode::ReadWrite) {
                Err(OpenError::DoesNotExist) => {}
                result => return Ok(result?),
            }
        }
        Err(CreateError::InternalError.into())
    }
}

impl<T: Debug + Send + Sync> Builder<'_, T> {
    fn file(&self) -> FileName {
        self.config.path_for(&self.name).file_name()
    }

    fn storage(&self, segment: Segment, owned: bool) -> Storage<T> {
        Storage {
            segment,
            name: self.name,
            file: self.file(),
            owned: AtomicBool::new(owned),
            value: PhantomData,
        }
    }

    fn open_once(&self, access: AccessMode) -> Result<Storage<T>, OpenError> {
        let segment = Segment::open(&self.file(), access).map_err(explain)?;
        let length = segment.length();
        let storage = self.storage(segment, false);
        if length < size_of::<Data<T>>() {
            return Err(OpenError::InitializationNotYetFinalized);
        }
        // SAFETY: it is long enough for a version, of which every bit pattern is valid.
        let version = unsafe { storage.data().cast::<AtomicU64>().as_ref() };
        // It is written last, so what follows is there when it is.
        let version = version.load(Ordering::SeqCst);
        // SAFETY: as above, and mapped; whoever makes it writes these bytes before the version, and never again.
        let beginning = unsafe { storage.data().cast::<[u8; 12]>().read() };
        if !is_complete(&beginning, length as u64) {
            Err(OpenError::InitializationNotYetFinalized)
        } else if version != PackageVersion::get().to_u64() {
            Err(OpenError::VersionMismatch)
        } else {
            Ok(storage)
        }
    }

    fn draft(&mut self, value: T) -> Result<Draft, CreateError> {
        const { Data::<T>::FITS };
        let length = (size_of::<Data<T>>() + self.supplement).next_multiple_of(PAGE);
        let pages = u32::try_from(length / PAGE).map_err(|_| CreateError::InternalError)?;
        let draft = Draft::new(&self.file(), length)
            .map_err(note(Site::Memory))
            .map_err(explain_creation)?;
        let [a, b, c, rest] = pages.to_le_bytes();
        let data = Data {
            version: AtomicU64::new(0),
            drops: self.drops.into(),
            pages: if rest == 0 { [a, b, c] } else { [0; 3] },
            value,
        };
        self.fill(draft.segment(), data)?;
        Ok(draft)
    }

    fn fill(&mut self, segment: &Segment, data: Data<T>) -> Result<(), CreateError> {
        let base: NonNull<Data<T>> = segment.base().cast();
        let supplement = segment.length() - size_of::<Data<T>>();
        // SAFETY: the segment begins at a page, has room for `Data` and what follows, and nobody else knows it yet.
        let data = unsafe {
            base.write(data);
            &mut *base.as_ptr()
        };
        // SAFETY: as above, so one behind `Data` is still in the segment.
        let behind = unsafe { base.add(1) };
        let mut allocator = BumpAllocator::new(behind.cast(), supplement);
        if !self.initializer.call(&mut data.value, &mut allocator) {
            return Err(CreateError::InitializationFailed);
        }
        data.version
            .store(PackageVersion::get().to_u64(), Ordering::SeqCst);
        Ok(())
    }

    fn publish(&self, draft: Draft) -> Result<Storage<T>, (Draft, CreateError)> {
        match draft.publish() {
            Ok(segment) => Ok(self.storage(segment, self.owned)),
            Err((draft, error)) => Err((draft, explain_creation(error))),
        }
    }
}

fn explain(refusal: Refusal) -> OpenError {
    match refusal {
        Refusal::Missing => OpenError::DoesNotExist,
        Refusal::HalfMade => OpenError::InitializationNotYetFinalized,
        Refusal::NotOurs => {
            note(Site::Memory)(Errno::PERM);
            OpenError::InternalError
        }
        Refusal::System(error) => {
            note(Site::Memory)(error);
            OpenError::InternalError
        }
    }
}

fn explain_creation(error: Errno) -> CreateError {
    match error {
        Errno::EXIST => CreateError::AlreadyExists,
        Errno::ACCESS | Errno::PERM => CreateError::InsufficientPermissions,
        _ => CreateError::InternalError,
    }
}
