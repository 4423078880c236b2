//! YOLO networks of other architectures. Their classes are red, green and blue, with the share of that colour in the input as
//! score; their boxes are fixed.

use super::{Attribute, Constant, Net};

/// Number of boxes, which exceeds the number of values per box, as usual.
pub const BOXES: usize = 12;

/// Returns a network whose boxes lie 10 px apart, at the left of an input of 160 × 96 px.
pub fn net(layout: &str) -> Net {
    let mut net = Net::empty(96, 160);
    net.metadata = vec![("names", "{0: 'red', 1: 'green', 2: 'blue'}".into())];
    let number = |values: &[usize], data| Constant::Floats(values.to_vec(), data);
    // Centre and size, by column.
    let boxes: [fn(usize) -> f32; 4] = [|n| 10.0 * n as f32 + 20.0, |_| 40.0, |_| 8.0, |_| 16.0];
    let boxes = boxes.iter().flat_map(|value| (0..BOXES).map(value)).collect();
    net.constants.insert("boxes".into(), number(&[1, 4, BOXES], boxes));
    net.constants.insert("ones".into(), number(&[1, 3, BOXES], vec![1.0; 3 * BOXES]));
    net.constants.insert("half".into(), number(&[1, 1, BOXES], vec![0.5; BOXES]));
    net.constants.insert("flat".into(), Constant::Ints(vec![3], vec![1, 3, 1]));
    let mean = net.node("GlobalAveragePool", &["image"], "mean", vec![]);
    let mean = net.node("Reshape", &[&mean, "flat"], "colours", vec![]);
    let scores = net.node("Mul", &["ones", &mean], "scores", vec![]);
    let axis = |axis| vec![("axis", Attribute::Int(axis))];
    let parts: &[&str] = match layout {
        "columns" => &["boxes", &scores],
        _ => &["boxes", "half", &scores],
    };
    let columns = net.node("Concat", parts, "output", axis(1));
    let turned = vec![("perm", Attribute::Ints(vec![0, 2, 1]))];
    let (output, shape) = match layout {
        "columns" => (columns, vec![1, 7, BOXES]),
        "rows" => (net.node("Transpose", &[&columns], "rows", turned), vec![1, BOXES, 8]),
        // Left, top, right, bottom, score, class; the score of the second box falls with the red of the image.
        _ => {
            let fixed =
                [[4.0, 10.0, 14.0, 30.0, 0.9, 2.0], [5.0, 10.0, 15.0, 30.0, 0.4, 2.0], [0.0, 0.0, 9.0, 9.0, 0.8, 7.0]];
            net.constants.insert("fixed".into(), number(&[1, 3, 6], fixed.concat()));
            net.constants.insert("none".into(), number(&[1, 3, 1], vec![0.0; 3]));
            let nothing = net.node("Mul", &["none", &mean], "nothing", vec![]);
            (net.node("Add", &["fixed", &nothing], "final", vec![]), vec![1, 3, 6])
        }
    };
    net.outputs = vec![(output, shape)];
    net
}

/// Returns the same network in columns, with masks: of two prototypes the first is positive above the middle of the input, the
/// second below; boxes with an even number have the upper one, the others the lower one.
pub fn net_with_masks() -> Net {
    let mut net = net("columns");
    let number = |values: &[usize], data| Constant::Floats(values.to_vec(), data);
    let coefficients = (0..2 * BOXES).map(|k| f32::from(u8::from(k % BOXES % 2 == k / BOXES))).collect();
    net.constants.insert("coefficients".into(), number(&[1, 2, BOXES], coefficients));
    let side = |k: usize| if (k / 960 == 0) == (k % 960 / 40 < 12) { 1.0 } else { -1.0 };
    net.constants.insert("sides".into(), number(&[1, 2, 24, 40], (0..1920).map(side).collect()));
    net.constants.insert("naught".into(), number(&[1, 1, 1, 1], vec![0.0]));
    let bare = net.outputs[0].0.clone();
    let output = net.node("Concat", &[&bare, "coefficients"], "with_masks", vec![("axis", Attribute::Int(1))]);
    let mean = net.node("GlobalAveragePool", &["image"], "again", vec![]);
    net.constants.insert("first".into(), Constant::Ints(vec![4], vec![1, 3, 1, 1]));
    let mean = net.node("Reshape", &[&mean, "first"], "four", vec![]);
    let sum = net.node("ReduceSum", &[&mean], "sum", vec![]);
    let nothing = net.node("Mul", &["naught", &sum], "nothing", vec![]);
    let prototypes = net.node("Add", &["sides", &nothing], "prototypes", vec![]);
    net.outputs = vec![(output, vec![1, 9, BOXES]), (prototypes, vec![1, 2, 24, 40])];
    net
}
