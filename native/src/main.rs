//! The command line.
// Used by the commands once they are there.
#[cfg(test)]
mod source;

fn main() {}
