//! GPU memory, counted where it is made.

use std::cell::RefCell;
use std::ops::Deref;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Bytes of the buffers and textures that were made while it was charged and still live.
#[derive(Clone, Debug, Default)]
pub struct Account(Arc<AtomicU64>);

thread_local! {
    static CHARGED: RefCell<Account> = RefCell::default();
}

impl Account {
    pub fn bytes(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }

    /// Does some work; what this thread makes meanwhile is charged to the account.
    pub fn charge<T>(&self, work: impl FnOnce() -> T) -> T {
        let before = CHARGED.replace(self.clone());
        let done = work();
        CHARGED.set(before);
        done
    }
}

/// A buffer or a texture on its account; clones are the same one.
#[derive(Clone, Debug)]
pub struct Counted<T> {
    it: T,
    _share: Arc<Share>,
}

pub type Buffer = Counted<wgpu::Buffer>;
pub type Texture = Counted<wgpu::Texture>;

#[derive(Debug)]
struct Share {
    bytes: u64,
    account: Account,
}

impl<T> Counted<T> {
    pub(super) fn new(it: T, bytes: u64) -> Counted<T> {
        let account = CHARGED.with_borrow(Clone::clone);
        account.0.fetch_add(bytes, Ordering::Relaxed);
        Counted { it, _share: Arc::new(Share { bytes, account }) }
    }
}

impl Drop for Share {
    fn drop(&mut self) {
        self.account.0.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

impl<T> Deref for Counted<T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.it
    }
}
