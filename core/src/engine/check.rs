//! Buffer tables and the checks that both engines make before they run commands.
use super::error::EngineError;
use crate::commands::{BufferId, Command, Commands, MAX_WORKGROUPS_PER_DIMENSION};
use alloc::{format, string::String, vec::Vec};

/// Sizes are rounded up to this many words, so that arrays of 4-vectors can be bound; never 0.
pub(super) fn allocated_words(words: usize) -> usize {
    words.max(1).next_multiple_of(4)
}

/// Refuses buffers over `limit_bytes`.
pub(super) fn buffer_size(
    name: &'static str,
    words: usize,
    limit_bytes: u64,
) -> Result<(), EngineError> {
    let bytes = (words as u64).saturating_mul(4);
    if bytes > limit_bytes {
        return Err(EngineError::BufferTooLarge { name, bytes, limit: limit_bytes });
    }
    Ok(())
}

/// A buffer with what the checks need.
pub(super) struct Entry<T> {
    pub name: &'static str,
    pub words: usize,
    pub data: T,
}

/// The buffers of an engine by id. Ids are never used twice.
pub(super) struct Table<T> {
    entries: Vec<Option<Entry<T>>>,
    allocated_words: usize,
    peak_words: usize,
}

impl<T> Table<T> {
    pub fn new() -> Self {
        Self { entries: Vec::new(), allocated_words: 0, peak_words: 0 }
    }

    pub fn insert(&mut self, name: &'static str, words: usize, data: T) -> BufferId {
        let id = BufferId(self.entries.len() as u32);
        self.entries.push(Some(Entry { name, words, data }));
        self.allocated_words += allocated_words(words);
        self.peak_words = self.peak_words.max(self.allocated_words);
        id
    }

    pub fn remove(&mut self, id: BufferId) -> Option<T> {
        let entry = self.entries.get_mut(id.0 as usize)?.take()?;
        self.allocated_words -= allocated_words(entry.words);
        Some(entry.data)
    }

    pub fn allocated_bytes(&self) -> u64 {
        4 * self.allocated_words as u64
    }

    pub fn peak_bytes(&self) -> u64 {
        4 * self.peak_words as u64
    }

    /// The buffer, or an error that says what was to be done with it.
    pub fn get(
        &self,
        id: BufferId,
        operation: impl FnOnce() -> String,
    ) -> Result<&Entry<T>, EngineError> {
        let entry = self.entries.get(id.0 as usize).and_then(Option::as_ref);
        entry.ok_or_else(|| EngineError::UnknownBuffer { operation: operation(), id })
    }

    /// The buffer for writing, once the commands have been checked.
    pub fn get_mut(&mut self, id: BufferId) -> Option<&mut T> {
        let entry = self.entries.get_mut(id.0 as usize)?.as_mut()?;
        Some(&mut entry.data)
    }

    /// Refuses ranges outside the buffer.
    pub fn check_range(
        &self,
        id: BufferId,
        operation: &'static str,
        offset_words: usize,
        words: usize,
    ) -> Result<&Entry<T>, EngineError> {
        let entry = self.get(id, || operation.into())?;
        match offset_words.checked_add(words) {
            Some(end) if end <= entry.words => Ok(entry),
            _ => Err(EngineError::OutOfRange {
                operation,
                buffer: entry.name,
                offset_words,
                words,
                size_words: entry.words,
            }),
        }
    }

    /// Refuses commands with any mistake among them.
    pub fn check(&self, commands: &Commands) -> Result<(), EngineError> {
        commands.list.iter().try_for_each(|command| self.check_command(command))
    }

    fn check_command(&self, command: &Command) -> Result<(), EngineError> {
        match *command {
            Command::Upload { buffer, offset_words, ref data } => {
                self.check_range(buffer, "upload", offset_words, data.len())?;
            }
            Command::Clear { buffer, offset_words, words } => {
                self.check_range(buffer, "clear", offset_words, words)?;
            }
            Command::Copy { src, src_offset_words, dst, dst_offset_words, words } => {
                let source = self.check_range(src, "copy from", src_offset_words, words)?;
                self.check_range(dst, "copy to", dst_offset_words, words)?;
                if src == dst {
                    return Err(EngineError::CopyWithinBuffer { buffer: source.name });
                }
            }
            Command::Dispatch { kernel, ref bindings, ref params, workgroups } => {
                let name = kernel.interface.name;
                if bindings.len() != kernel.interface.bindings.len() {
                    return Err(EngineError::BindingCount {
                        kernel: name,
                        expected: kernel.interface.bindings.len(),
                        found: bindings.len(),
                    });
                }
                for (i, id) in bindings.iter().enumerate() {
                    let entry = self.get(*id, || {
                        format!("kernel {name}, binding {}", kernel.interface.bindings[i].name)
                    })?;
                    if let Some(first) = bindings[..i].iter().position(|other| other == id) {
                        return Err(EngineError::BoundTwice {
                            kernel: name,
                            buffer: entry.name,
                            first: kernel.interface.bindings[first].name,
                            second: kernel.interface.bindings[i].name,
                        });
                    }
                }
                if 4 * params.len() != kernel.interface.params.size {
                    return Err(EngineError::ParamsSize {
                        kernel: name,
                        expected: kernel.interface.params.size,
                        found: 4 * params.len(),
                    });
                }
                let total = workgroups.iter().try_fold(1u32, |product, n| product.checked_mul(*n));
                let most = workgroups.iter().copied().max().unwrap_or(0);
                if total.is_none() || most > MAX_WORKGROUPS_PER_DIMENSION {
                    return Err(EngineError::TooManyWorkgroups { kernel: name, workgroups });
                }
            }
        }
        Ok(())
    }
}
