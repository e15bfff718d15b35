//! A value that a callback delivers to a future.
#[cfg(target_arch = "wasm32")]
use std::{
    future::Future,
    pin::Pin,
    task::{Context, Poll},
};
use std::{
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    task::Waker,
};

struct Shared<T> {
    value: Option<T>,
    waker: Option<Waker>,
}

/// Waits for the value.
pub(super) struct Receiver<T>(Arc<Mutex<Shared<T>>>);

/// Delivers the value.
pub(super) struct Sender<T>(Arc<Mutex<Shared<T>>>);

/// A connected pair.
pub(super) fn channel<T>() -> (Sender<T>, Receiver<T>) {
    let shared = Arc::new(Mutex::new(Shared { value: None, waker: None }));
    (Sender(shared.clone()), Receiver(shared))
}

/// A panic of another thread does not spoil what is behind the lock.
pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl<T> Sender<T> {
    /// Delivers the value and wakes the receiver.
    pub fn send(self, value: T) {
        let mut shared = lock(&self.0);
        shared.value = Some(value);
        let waker = shared.waker.take();
        drop(shared);
        if let Some(waker) = waker {
            waker.wake();
        }
    }
}

#[cfg(not(target_arch = "wasm32"))]
impl<T> Receiver<T> {
    /// The value, if it has arrived.
    pub fn take(&self) -> Option<T> {
        lock(&self.0).value.take()
    }
}

#[cfg(target_arch = "wasm32")]
impl<T> Future for Receiver<T> {
    type Output = T;

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<T> {
        let mut shared = lock(&self.0);
        match shared.value.take() {
            Some(value) => Poll::Ready(value),
            None => {
                shared.waker = Some(context.waker().clone());
                Poll::Pending
            }
        }
    }
}
