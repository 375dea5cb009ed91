//! Cache of results for documents in the history.

use std::collections::VecDeque;

use crate::document::Key;

/// Default size limit, bytes.
const CACHE_BYTES: usize = 256 << 20;

/// Results by the [`Key`] of the document they were computed from. Evicts the least recently used results above a limit
/// in bytes.
#[derive(Debug)]
pub struct Cache<T> {
    /// Entries, most recently used last.
    entries: VecDeque<Entry<T>>,
    limit: usize,
}

#[derive(Debug)]
struct Entry<T> {
    key: Key,
    bytes: usize,
    result: T,
}

impl<T> Default for Cache<T> {
    fn default() -> Self {
        Self::new(CACHE_BYTES)
    }
}

impl<T> Cache<T> {
    /// Creates an empty cache with a limit in bytes.
    #[must_use]
    pub fn new(limit: usize) -> Self {
        Self { entries: VecDeque::new(), limit }
    }

    /// Inserts a result, replacing an earlier one of the same key. Ignores results larger than the limit.
    pub fn insert(&mut self, key: Key, result: T, bytes: usize) {
        self.entries.retain(|entry| entry.key != key);
        if bytes > self.limit {
            return;
        }
        self.entries.push_back(Entry { key, bytes, result });
        while self.entries.iter().map(|entry| entry.bytes).sum::<usize>() > self.limit {
            self.entries.pop_front();
        }
    }

    /// Returns the result for a key, and marks it as most recently used.
    pub fn get(&mut self, key: Key) -> Option<&T> {
        let place = self.entries.iter().position(|entry| entry.key == key)?;
        let entry = self.entries.remove(place)?;
        self.entries.push_back(entry);
        self.entries.back().map(|entry| &entry.result)
    }

    /// Whether there is a result for a key.
    #[must_use]
    pub fn contains(&self, key: Key) -> bool {
        self.entries.iter().any(|entry| entry.key == key)
    }

    /// Removes all results.
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
    fn least_recently_used_results_are_evicted() {
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
        assert_eq!(cache.get(key(3)), Some(&"again"), "a result that is too large evicts nothing");
    }
}
