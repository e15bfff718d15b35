//! The WGSL preprocessor: declarations of bindings, imports, constants, loops and conditions.
//!
//! Directives stand on lines of their own: `#bindings`, once in each kernel, becomes the declarations
//! of its parameters and bindings; `#import shared/NAME.wgsl` (each file at most once),
//! `#for k in A..B` ... `#end`, `#if EXPRESSION` ... `#else` ... `#end`. In all other lines
//! `${EXPRESSION}` becomes a number, and the word `WORKGROUP_SIZE` becomes the kernel's `256u`
//! style literal. Expressions are integer arithmetic (`+ - * / %`, comparisons, `&& || !`,
//! parentheses) on literals, loop variables and [`CONSTANTS`].
use crate::{constants::CONSTANTS, expression, header::header, interface::Interface};
use alloc::{
    string::{String, ToString},
    vec::Vec,
};

macro_rules! shared {
    ($path:literal) => {
        ($path, crate::embedded_shader!(concat!(env!("CARGO_MANIFEST_DIR"), "/", $path)))
    };
}

/// Files that shaders may import.
pub const SHARED: &[(&str, &str)] = &[
    shared!("shared/angle.wgsl"),
    shared!("shared/appearance.wgsl"),
    shared!("shared/dispatch.wgsl"),
    shared!("shared/flags.wgsl"),
    shared!("shared/geometry.wgsl"),
    shared!("shared/geometry_gradient.wgsl"),
    shared!("shared/geometry_mlp.wgsl"),
    shared!("shared/head.wgsl"),
    shared!("shared/lane_sums.wgsl"),
    shared!("shared/planes.wgsl"),
    shared!("shared/random.wgsl"),
    shared!("shared/rays.wgsl"),
    shared!("shared/semantic.wgsl"),
    shared!("shared/surface.wgsl"),
    shared!("shared/token_layers.wgsl"),
    shared!("shared/tokens.wgsl"),
    shared!("shared/weights.wgsl"),
];

/// Limit on the total of unrolled iterations of one shader: more is a mistake, not a kernel.
const MAX_ITERATIONS: i64 = 100_000;

/// Why a shader could not be composed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ShaderError {
    /// A mistake in the source.
    #[error("{file}.wgsl line {line}: {problem}")]
    Source {
        /// Kernel name, or `shared/NAME` of an imported file.
        file: String,
        /// Line, counted from 1.
        line: usize,
        /// What is wrong.
        problem: String,
    },
    /// An override of a constant that does not exist.
    #[error("there is no shader constant {name} to override; known are: {known}")]
    UnknownOverride {
        /// The name given.
        name: String,
        /// The names that exist.
        known: String,
    },
}

/// The WGSL of `kernel` with the constants of [`CONSTANTS`], changed by `overrides`.
pub fn compose(kernel: &Interface, overrides: &[(&str, u32)]) -> Result<String, ShaderError> {
    compose_with(kernel, SHARED, overrides)
}

/// As [`compose`], with importable files of the caller's.
pub fn compose_with(
    kernel: &Interface,
    shared: &[(&str, &str)],
    overrides: &[(&str, u32)],
) -> Result<String, ShaderError> {
    let mut names: Vec<(String, i64)> = Vec::new();
    names.extend(CONSTANTS.iter().map(|(name, value)| (name.to_string(), i64::from(*value))));
    for (name, value) in overrides {
        match names.iter_mut().find(|(known, _)| known == name) {
            Some(entry) => entry.1 = i64::from(*value),
            None => {
                let known: Vec<&str> = CONSTANTS.iter().map(|(name, _)| *name).collect();
                return Err(ShaderError::UnknownOverride {
                    name: name.to_string(),
                    known: known.join(", "),
                });
            }
        }
    }
    names.push(("WORKGROUP_SIZE".into(), i64::from(kernel.workgroup_size)));
    let mut composer = Composer {
        kernel,
        shared,
        names,
        imported: Vec::new(),
        declared: false,
        iterations: 0,
        workgroup_size: alloc::format!("{}u", kernel.workgroup_size),
        out: String::with_capacity(2 * kernel.wgsl.len()),
    };
    composer.file(kernel.name, kernel.wgsl)?;
    if !composer.declared {
        let line = Line { file: kernel.name, number: 1, text: "" };
        return Err(line.error("no #bindings in the kernel"));
    }
    Ok(composer.out)
}

/// A source line: file, number, text.
#[derive(Clone, Copy)]
struct Line<'a> {
    file: &'a str,
    number: usize,
    text: &'a str,
}

impl Line<'_> {
    fn error(&self, problem: impl Into<String>) -> ShaderError {
        let file = self.file.trim_end_matches(".wgsl").to_string();
        ShaderError::Source { file, line: self.number, problem: problem.into() }
    }

    /// The directive's word and the rest of its line.
    fn directive(&self) -> Option<(&str, &str)> {
        let text = self.text.trim().strip_prefix('#')?;
        let (word, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
        Some((word, rest.trim()))
    }
}

struct Composer<'s> {
    kernel: &'s Interface,
    shared: &'s [(&'s str, &'s str)],
    /// Visible names; later entries hide earlier ones.
    names: Vec<(String, i64)>,
    imported: Vec<&'s str>,
    /// Whether the bindings have been declared.
    declared: bool,
    iterations: i64,
    workgroup_size: String,
    out: String,
}

impl Composer<'_> {
    fn file(&mut self, file: &str, source: &str) -> Result<(), ShaderError> {
        let lines: Vec<Line<'_>> = source
            .lines()
            .enumerate()
            .map(|(i, text)| Line { file, number: i + 1, text })
            .collect();
        self.block(&lines)
    }

    fn block(&mut self, lines: &[Line<'_>]) -> Result<(), ShaderError> {
        let mut i = 0;
        while let Some(line) = lines.get(i) {
            i += 1;
            match line.directive() {
                None => self.text(line)?,
                Some(("import", name)) => self.import(line, name)?,
                Some(("bindings", "")) => self.bindings(line)?,
                Some(("for", header)) => {
                    let (body, rest) = (i, end_of_block(lines, i, line)?);
                    if rest.otherwise.is_some() {
                        return Err(line.error("#for has an #else"));
                    }
                    self.repeat(line, header, &lines[body..rest.end])?;
                    i = rest.end + 1;
                }
                Some(("if", condition)) => {
                    let rest = end_of_block(lines, i, line)?;
                    let split = rest.otherwise.unwrap_or(rest.end);
                    if self.evaluate(line, condition)? != 0 {
                        self.block(&lines[i..split])?;
                    } else if split < rest.end {
                        self.block(&lines[split + 1..rest.end])?;
                    }
                    i = rest.end + 1;
                }
                Some((word, _)) => {
                    let problem = alloc::format!(
                        "#{word} here: expected #bindings, #import, #for or #if, or an #if or #for before it"
                    );
                    return Err(line.error(problem));
                }
            }
        }
        Ok(())
    }

    fn bindings(&mut self, line: &Line<'_>) -> Result<(), ShaderError> {
        if self.declared {
            return Err(line.error("a second #bindings"));
        }
        self.declared = true;
        self.out.push_str(&header(self.kernel));
        Ok(())
    }

    fn import(&mut self, line: &Line<'_>, name: &str) -> Result<(), ShaderError> {
        let Some((path, source)) = self.shared.iter().find(|(path, _)| *path == name) else {
            return Err(line.error(alloc::format!("no importable file {name:?}")));
        };
        // Marked before it is read, so that files that import each other end.
        if !self.imported.contains(path) {
            self.imported.push(path);
            self.file(path, source)?;
        }
        Ok(())
    }

    fn repeat(
        &mut self,
        line: &Line<'_>,
        header: &str,
        body: &[Line<'_>],
    ) -> Result<(), ShaderError> {
        let parsed = header.split_once(" in ").and_then(|(variable, range)| {
            let (start, end) = range.split_once("..")?;
            let variable = variable.trim();
            expression::is_name(variable).then_some((variable, start, end))
        });
        let Some((variable, start, end)) = parsed else {
            return Err(line.error("expected `#for NAME in START..END`"));
        };
        let (start, end) = (self.evaluate(line, start)?, self.evaluate(line, end)?);
        self.iterations = self.iterations.saturating_add(end.saturating_sub(start).max(0));
        if self.iterations > MAX_ITERATIONS {
            return Err(line.error(alloc::format!("more than {MAX_ITERATIONS} iterations")));
        }
        for value in start..end {
            self.names.push((variable.to_string(), value));
            let result = self.block(body);
            self.names.pop();
            result?;
        }
        Ok(())
    }

    fn text(&mut self, line: &Line<'_>) -> Result<(), ShaderError> {
        let mut rest = line.text;
        while let Some((before, after)) = rest.split_once("${") {
            self.push_text(before);
            let Some((inner, after)) = after.split_once('}') else {
                return Err(line.error("`${` without `}`"));
            };
            let value = self.evaluate(line, inner)?;
            self.out.push_str(&value.to_string());
            rest = after;
        }
        self.push_text(rest);
        self.out.push('\n');
        Ok(())
    }

    /// Appends text with the whole word `WORKGROUP_SIZE` replaced.
    fn push_text(&mut self, text: &str) {
        const WORD: &str = "WORKGROUP_SIZE";
        let part_of_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let mut done = 0;
        for (at, _) in text.match_indices(WORD) {
            let before = text[..at].chars().next_back().is_some_and(part_of_name);
            let after = text[at + WORD.len()..].chars().next().is_some_and(part_of_name);
            if !before && !after {
                self.out.push_str(&text[done..at]);
                self.out.push_str(&self.workgroup_size);
                done = at + WORD.len();
            }
        }
        self.out.push_str(&text[done..]);
    }

    fn evaluate(&self, line: &Line<'_>, text: &str) -> Result<i64, ShaderError> {
        let lookup = |name: &str| {
            self.names.iter().rev().find(|(known, _)| known == name).map(|(_, value)| *value)
        };
        expression::evaluate(text, &lookup).map_err(|problem| line.error(problem))
    }
}

/// Where a block's `#else` (of the same level) and `#end` are.
struct BlockEnd {
    otherwise: Option<usize>,
    end: usize,
}

fn end_of_block(
    lines: &[Line<'_>],
    start: usize,
    opener: &Line<'_>,
) -> Result<BlockEnd, ShaderError> {
    let (mut depth, mut otherwise) = (0, None);
    for (i, line) in lines.iter().enumerate().skip(start) {
        match line.directive() {
            Some(("for" | "if", _)) => depth += 1,
            Some(("else", _)) if depth == 0 => {
                if otherwise.is_some() {
                    return Err(line.error("a second #else"));
                }
                otherwise = Some(i);
            }
            Some(("end", _)) if depth == 0 => return Ok(BlockEnd { otherwise, end: i }),
            Some(("end", _)) => depth -= 1,
            _ => {}
        }
    }
    Err(opener.error("no #end for this line"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::structs::StructLayout;

    const FILES: &[(&str, &str)] = &[
        ("shared/a.wgsl", "// a\n#import shared/b.wgsl\n"),
        ("shared/b.wgsl", "// b ${CHANNELS}\n#import shared/a.wgsl\n"),
        ("shared/bad.wgsl", "fine\n${NOPE}\n"),
    ];

    /// A kernel without parameters and bindings, so that nothing stands for `#bindings`.
    fn kernel(source: &str) -> Interface {
        Interface {
            name: "test",
            wgsl: alloc::boxed::Box::leak(alloc::format!("{source}\n#bindings").into()),
            workgroup_size: 64,
            bindings: &[],
            params: &StructLayout { name: "None", fields: &[], size: 0 },
        }
    }

    fn run(source: &str) -> Result<String, ShaderError> {
        compose_with(&kernel(source), FILES, &[])
    }

    /// The error's file, line and text.
    fn problem(source: &str) -> (String, usize, String) {
        match run(source) {
            Err(ShaderError::Source { file, line, problem }) => (file, line, problem),
            other => panic!("expected a source error, got {other:?}"),
        }
    }

    #[test]
    fn constants_and_expressions_are_substituted() {
        let text = "a[${CHANNELS*2+1}] ${(CHANNELS-LEVELS)/3%4} @workgroup_size(WORKGROUP_SIZE) \
                    MY_WORKGROUP_SIZE ${WORKGROUP_SIZE}";
        let expected = "a[33] 0 @workgroup_size(64u) MY_WORKGROUP_SIZE 64\n";
        assert_eq!(run(text).unwrap(), expected);
        let changed = compose_with(&kernel("${CHANNELS}"), FILES, &[("CHANNELS", 4)]);
        assert_eq!(changed.unwrap(), "4\n");
    }

    #[test]
    fn loops_nest_and_conditions_choose() {
        let text = "#for k in 0..LEVELS\n#for j in k..2\nx${k}${j*10}\n#end\n#end\n\
                    #if CHANNELS == 16\nequal\n#else\nother\n#end\n\
                    #for k in 0..3\n#if k > 1\nbig ${k}\n#else\n#if k == 0\nzero\n#end\n#end\n#end";
        assert_eq!(run(text).unwrap(), "x00\nx010\nx110\nequal\nzero\nbig 2\n");
        let plain = compose_with(&kernel("#if LEVELS\na\n#else\nb\n#end"), FILES, &[("LEVELS", 0)]);
        assert_eq!(plain.unwrap(), "b\n");
        assert_eq!(run("#for k in 3..1\nx\n#end").unwrap(), "");
    }

    #[test]
    fn imports_come_once_even_in_circles() {
        let text = "#import shared/b.wgsl\n#import shared/a.wgsl\nend";
        assert_eq!(run(text).unwrap(), "// b 16\n// a\nend\n");
    }

    #[test]
    fn mistakes_name_file_and_line() {
        assert_eq!(problem("a\n${NOPE}"), ("test".into(), 2, "unknown name NOPE".into()));
        assert_eq!(problem("#import shared/bad.wgsl").0, "shared/bad");
        assert_eq!(problem("#import shared/bad.wgsl").1, 2);
        assert!(problem("x\n\n#import shared/none.wgsl").2.contains("no importable file"));
        assert!(problem("#for k in 0..2\nx").2.contains("no #end"));
        assert!(problem("#if 1\n#if 1\n#end").2.contains("no #end"));
        assert_eq!(problem("x\n#end").1, 2);
        assert_eq!(problem("#if 1\n#else\n#else\n#end").1, 3);
        assert!(problem("#for k in 0..2\n#else\n#end").2.contains("#else"));
        assert!(problem("#for 0..2\n#end").2.contains("#for NAME in"));
        assert!(problem("#for k in 0..1000000\nx\n#end").2.contains("iterations"));
        assert!(problem("#while 1").2.contains("#while"));
        assert_eq!(problem("x\n#bindings").1, 3);
        let undeclared = Interface { wgsl: "x", ..kernel("") };
        assert!(compose_with(&undeclared, FILES, &[]).is_err());
        assert!(problem("${1").2.contains("without"));
        assert!(matches!(
            compose_with(&kernel(""), FILES, &[("CHANELS", 4)]),
            Err(ShaderError::UnknownOverride { name, .. }) if name == "CHANELS"
        ));
    }

    #[test]
    fn every_registered_kernel_composes() {
        for kernel in crate::kernels::ALL {
            let text = compose(kernel, &[]).unwrap();
            assert!(text.contains("fn main") && !text.contains("${"), "{}", kernel.name);
            let known = |import: &str| SHARED.iter().any(|(path, _)| *path == import);
            assert!(kernel.imports().all(known), "{}", kernel.name);
        }
    }
}
