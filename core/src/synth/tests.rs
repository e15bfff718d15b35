use super::*;

fn sequence(options: SyntheticOptions) -> SyntheticSequence {
    SyntheticSequence::new(options)
}

#[test]
fn builds() {
    let mut s = sequence(SyntheticOptions::tiny());
    assert!(s.frame(0).is_ok());
}
