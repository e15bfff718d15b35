//! Integer expressions of the preprocessor.
use alloc::{format, string::String};

/// Levels of binary operators from weakest to strongest. Longer operators come first where one
/// begins with another.
const OPERATORS: [&[&str]; 5] =
    [&["||"], &["&&"], &["==", "!=", "<=", ">=", "<", ">"], &["+", "-"], &["*", "/", "%"]];

/// Deepest nesting of parentheses and signs.
const MAX_DEPTH: usize = 64;

/// The value of `text`, or what is wrong with it. Comparisons give 0 or 1.
pub(super) fn evaluate(text: &str, lookup: &dyn Fn(&str) -> Option<i64>) -> Result<i64, String> {
    let mut parser = Parser { rest: text.trim(), lookup, depth: 0 };
    let value = parser.level(0)?;
    if parser.rest.is_empty() {
        Ok(value)
    } else {
        Err(format!("unexpected {:?} in expression {:?}", parser.rest, text.trim()))
    }
}

/// Whether `text` is an identifier.
pub(super) fn is_name(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
        && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

struct Parser<'a> {
    rest: &'a str,
    lookup: &'a dyn Fn(&str) -> Option<i64>,
    depth: usize,
}

impl Parser<'_> {
    fn take(&mut self, token: &str) -> bool {
        match self.rest.strip_prefix(token) {
            Some(rest) => {
                self.rest = rest.trim_start();
                true
            }
            None => false,
        }
    }

    fn level(&mut self, level: usize) -> Result<i64, String> {
        let Some(operators) = OPERATORS.get(level) else {
            return self.operand();
        };
        let mut left = self.level(level + 1)?;
        while let Some(operator) = operators.iter().copied().find(|o| self.take(o)) {
            let right = self.level(level + 1)?;
            left = apply(operator, left, right)
                .ok_or_else(|| format!("{left} {operator} {right} has no value"))?;
        }
        Ok(left)
    }

    fn operand(&mut self) -> Result<i64, String> {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return Err("expression nested too deeply".into());
        }
        let value = if self.take("(") {
            let value = self.level(0)?;
            if !self.take(")") {
                return Err("missing ) in expression".into());
            }
            value
        } else if self.take("-") {
            let value = self.operand()?;
            value.checked_neg().ok_or_else(|| format!("-{value} has no value"))?
        } else if self.take("!") {
            i64::from(self.operand()? == 0)
        } else {
            self.literal_or_name()?
        };
        self.depth -= 1;
        Ok(value)
    }

    fn literal_or_name(&mut self) -> Result<i64, String> {
        let part = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let length = self.rest.find(|c| !part(c)).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(length);
        self.rest = rest.trim_start();
        if word.is_empty() {
            return Err(format!("expected a number or a name before {:?}", self.rest));
        }
        if is_name(word) {
            return (self.lookup)(word).ok_or_else(|| format!("unknown name {word}"));
        }
        word.parse().map_err(|_| format!("{word} is not a number"))
    }
}

/// None where the result does not exist (division by zero, overflow).
fn apply(operator: &str, a: i64, b: i64) -> Option<i64> {
    match operator {
        "+" => a.checked_add(b),
        "-" => a.checked_sub(b),
        "*" => a.checked_mul(b),
        "/" => a.checked_div(b),
        "%" => a.checked_rem(b),
        "==" => Some(i64::from(a == b)),
        "!=" => Some(i64::from(a != b)),
        "<" => Some(i64::from(a < b)),
        "<=" => Some(i64::from(a <= b)),
        ">" => Some(i64::from(a > b)),
        ">=" => Some(i64::from(a >= b)),
        "&&" => Some(i64::from(a != 0 && b != 0)),
        "||" => Some(i64::from(a != 0 || b != 0)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str) -> Result<i64, String> {
        evaluate(text, &|name| (name == "N").then_some(7))
    }

    #[test]
    fn precedence_and_comparisons() {
        for (text, expected) in [
            ("1+2*3", 7),
            ("(1+2)*3", 9),
            ("10-4-3", 3),
            ("-N+1", -6),
            ("N%4", 3),
            ("N==7", 1),
            ("N > 7 || N >= 7", 1),
            ("N<7&&1", 0),
            ("!N", 0),
            ("1+1==2", 1),
        ] {
            assert_eq!(value(text), Ok(expected), "{text}");
        }
    }

    #[test]
    fn mistakes_are_explained() {
        for (text, part) in [
            ("", "expected a number"),
            ("1+", "expected a number"),
            ("(1", "missing )"),
            ("1 2", "unexpected"),
            ("M", "unknown name M"),
            ("1/0", "has no value"),
            ("9223372036854775807+1", "has no value"),
            ("12abc", "not a number"),
        ] {
            let error = value(text).unwrap_err();
            assert!(error.contains(part), "{text}: {error}");
        }
        assert!(value(&"(".repeat(100_000)).is_err());
    }
}
