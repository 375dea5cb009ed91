//! Results kept for documents that undo and redo come back to.

use std::collections::VecDeque;

use crate::document::Key;

/// Results by what they were computed from. The ones used least recently go when all exceed a number of bytes.
#[derive(Debug)]
pub struct Cache<T> {
    /// The one used last at the end.
    entries: VecDeque<Entry<T>>,
    limit: usize,
}

#[derive(Debug)]
struct Entry<T> {
    key: Key,
    bytes: usize,
    result: T,
}

impl<T> Cache<T> {
    /// An empty cache that keeps at most so many bytes.
    #[must_use]
    pub fn new(limit: usize) -> Self {
        Self { entries: VecDeque::new(), limit }
    }

    /// Keeps a result in place of an earlier one of the same key. One that is larger than the limit is not kept.
    pub fn insert(&mut self, key: Key, result: T, bytes: usize) {
        self.entries.retain(|entry| entry.key != key);
        self.entries.push_back(Entry { key, bytes, result });
        while self.entries.iter().map(|entry| entry.bytes).sum::<usize>() > self.limit {
            self.entries.pop_front();
        }
    }

    /// The result of a key.
    pub fn get(&mut self, key: Key) -> Option<&T> {
        let place = self.entries.iter().position(|entry| entry.key == key)?;
        let entry = self.entries.remove(place)?;
        self.entries.push_back(entry);
        self.entries.back().map(|entry| &entry.result)
    }

    /// Whether there is a result of a key.
    #[must_use]
    pub fn contains(&self, key: Key) -> bool {
        self.entries.iter().any(|entry| entry.key == key)
    }

    /// Drops everything.
    pub fn clear(&mut self) {
        self.entries.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(cage: u64) -> Key {
        Key { mesh: 1, cage }
    }

    #[test]
    fn least_recently_used_results_are_dropped_at_the_limit() {
        let mut cache = Cache::new(100);
        cache.insert(key(1), "one", 40);
        cache.insert(key(2), "two", 40);
        assert_eq!(cache.get(key(1)), Some(&"one"));
        cache.insert(key(3), "three", 40);
        assert_eq!([1, 2, 3].map(|k| cache.get(key(k)).copied()), [Some("one"), None, Some("three")]);
        cache.insert(key(3), "again", 60);
        assert_eq!(cache.get(key(3)), Some(&"again"));
        cache.insert(key(4), "too large", 101);
        assert_eq!(cache.get(key(4)), None);
    }
}
