//! The columns of a line, with blanks, commas or semicolons between them, and the order of a quaternion.

/// Returns the columns of a line.
pub fn columns(line: &str) -> impl Iterator<Item = &str> + Clone {
    line.split(|c: char| c.is_whitespace() || c == ',' || c == ';').filter(|word| !word.is_empty())
}

/// Order of the four numbers of a quaternion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QuaternionOrder {
    ScalarLast,
    ScalarFirst,
}

/// Returns the order that the names of the columns state, such as `q_RS_w [], q_RS_x []` or `qx,qy,qz,qw`.
pub fn order_in_header(header: &str) -> Option<QuaternionOrder> {
    let names: Vec<String> = header
        .trim_start_matches('#')
        .split([',', ';', ' ', '\t'])
        .map(|name| name.trim().to_ascii_lowercase())
        .filter(|name| name.starts_with('q') || name.contains("quat") || name.contains("orientation"))
        .collect();
    let at = |end: char| names.iter().position(|name| name.ends_with(end));
    let (w, x) = (at('w')?, at('x')?);
    Some(if w < x { QuaternionOrder::ScalarFirst } else { QuaternionOrder::ScalarLast })
}
