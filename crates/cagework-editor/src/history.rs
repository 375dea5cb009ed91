//! Undo history, stored as a list of documents.

use std::collections::VecDeque;

use crate::document::Document;

/// Default limit of the history, bytes.
pub const HISTORY_BYTES: usize = 256 << 20;

/// A step of the history, with the document before the step or, while the step is undone, the document after it.
#[derive(Clone, Debug)]
struct Step {
    label: String,
    document: Document,
    /// Size of the data in `document` that the document on the other side of the step does not share, bytes.
    bytes: usize,
}

/// Steps that can be undone and redone.
#[derive(Clone, Debug)]
pub(crate) struct History {
    done: VecDeque<Step>,
    undone: Vec<Step>,
    limit: usize,
    forgotten: usize,
}

impl Default for History {
    fn default() -> Self {
        Self { done: VecDeque::new(), undone: Vec::new(), limit: HISTORY_BYTES, forgotten: 0 }
    }
}

impl History {
    pub(crate) fn with_limit(limit: usize) -> Self {
        Self { limit, ..Self::default() }
    }

    /// Records a step from `before` to `after`, and drops undone steps. Above the limit, drops the oldest steps, but
    /// never the latest.
    pub(crate) fn push(&mut self, label: String, before: Document, after: &Document) {
        let bytes = before.bytes_beyond(after);
        self.undone.clear();
        self.done.push_back(Step { label, document: before, bytes });
        let mut bytes: usize = self.done.iter().map(|step| step.bytes).sum();
        while bytes > self.limit && self.done.len() > 1 {
            bytes -= self.done.pop_front().map_or(0, |step| step.bytes);
            self.forgotten += 1;
        }
    }

    /// Swaps `now` for the document before the last step; false if there is no step to undo.
    pub(crate) fn undo(&mut self, now: &mut Document) -> bool {
        let Some(mut step) = self.done.pop_back() else { return false };
        std::mem::swap(now, &mut step.document);
        self.undone.push(step);
        true
    }

    /// Like [`Self::undo`], and drops the step.
    pub(crate) fn retract(&mut self, now: &mut Document) -> bool {
        self.undo(now) && self.undone.pop().is_some()
    }

    /// Swaps `now` for the document after the step that was undone last; false if there is no such step.
    pub(crate) fn redo(&mut self, now: &mut Document) -> bool {
        let Some(mut step) = self.undone.pop() else { return false };
        std::mem::swap(now, &mut step.document);
        self.done.push_back(step);
        true
    }

    pub(crate) fn undo_label(&self) -> Option<&str> {
        self.done.back().map(|step| step.label.as_str())
    }

    pub(crate) fn redo_label(&self) -> Option<&str> {
        self.undone.last().map(|step| step.label.as_str())
    }

    pub(crate) fn limit(&self) -> usize {
        self.limit
    }

    /// Number of steps that were dropped because of the limit.
    pub(crate) fn forgotten(&self) -> usize {
        self.forgotten
    }
}
