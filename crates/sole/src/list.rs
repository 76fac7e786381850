//! Lists that are filled anew in every tick.

use std::ops::{Deref, DerefMut};

/// A list with room for as many entries as it was made for. So has its clone, other than that of a `Vec`, which would allocate when it is
/// filled: in the middle of a tick.
#[derive(Debug)]
pub(crate) struct List<T>(Vec<T>);

impl<T> List<T> {
    pub(crate) fn with_room_for(count: usize) -> Self {
        Self(Vec::with_capacity(count))
    }
}

impl<T: Clone> Clone for List<T> {
    fn clone(&self) -> Self {
        let mut entries = Vec::with_capacity(self.0.capacity());
        entries.extend_from_slice(&self.0);
        Self(entries)
    }
}

impl<T> Deref for List<T> {
    type Target = Vec<T>;

    fn deref(&self) -> &Vec<T> {
        &self.0
    }
}

impl<T> DerefMut for List<T> {
    fn deref_mut(&mut self) -> &mut Vec<T> {
        &mut self.0
    }
}
