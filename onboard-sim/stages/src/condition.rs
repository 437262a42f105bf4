//! Conditions on the states.

/// A scalar condition on one state component of one node: `sign * component - offset` must be zero (an equality) or not
/// negative, in the state's units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Condition {
    /// The node, 1 to the number of intervals.
    pub node: usize,
    /// The component in state order.
    pub component: usize,
    /// Sign of the component, 1 or -1.
    pub sign: f64,
    /// The value that the signed component is compared with.
    pub offset: f64,
    /// Whether the condition is an equality.
    pub equality: bool,
}

impl Condition {
    /// The condition's value on a path; NaN if it has no such node.
    #[inline]
    pub fn value<const NX: usize>(&self, states: &[[f64; NX]]) -> f64 {
        let component = states.get(self.node).and_then(|state| state.get(self.component));
        component.map_or(f64::NAN, |value| self.sign * value - self.offset)
    }

    /// By how much a value breaks the condition.
    #[inline]
    pub fn violation(&self, value: f64) -> f64 {
        if self.equality { value.abs() } else { (-value).max(0.0) }
    }

    /// The range of its multiplier.
    #[inline]
    pub(crate) fn range(&self, price: f64) -> (f64, f64) {
        (if self.equality { -price } else { 0.0 }, price)
    }
}
