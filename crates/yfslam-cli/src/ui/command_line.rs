//! The command line as text.

/// Returns the command line of this process, quoted for a shell.
pub fn command_line() -> String {
    let arguments = std::env::args_os().skip(1).map(|argument| quote(&argument.to_string_lossy()));
    ["yfslam".to_owned()].into_iter().chain(arguments).collect::<Vec<_>>().join(" ")
}

/// Quotes a word for a shell where that is necessary.
pub fn quote(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./:=,+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_that_a_shell_would_change_is_quoted() {
        assert_eq!(quote("a/b-c.onnx"), "a/b-c.onnx");
        assert_eq!(quote("synth:x?a=1&b"), "'synth:x?a=1&b'");
        assert_eq!(quote("it's"), "'it'\\''s'");
        assert_eq!(quote(""), "''");
    }
}
