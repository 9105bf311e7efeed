//! The order in which any-hit streams visit children: that of their lanes, by cost, or the farthest first.

/// Chooses the order by the tests that the first rays take.
#[derive(Default)]
pub(crate) struct Order {
    /// Number of streams that try the orders.
    trials: usize,
    /// Number of streams begun.
    begun: usize,
    /// Rays of finished streams, and their tests: by cost, then the farthest child first.
    rays: [u64; 2],
    tests: [u64; 2],
}

impl Order {
    /// Price of a test with the farthest child first, where children must be sorted, in percent of one by cost. Found by experiment.
    const FARTHEST_PERCENT: u64 = 130;

    /// Tries the orders with the first `trials` streams.
    pub(crate) fn of_trials(trials: usize) -> Self {
        Self { trials, ..Self::default() }
    }

    /// Adds a finished stream, which may be empty.
    pub(crate) fn add(&mut self, farthest_first: bool, rays: usize, tests: u32) {
        self.rays[usize::from(farthest_first)] += rays as u64;
        self.tests[usize::from(farthest_first)] += u64::from(tests);
    }

    /// The order for the next stream. Of the first ones, which begin together, one tries the order by cost.
    pub(crate) fn is_farthest_first(&mut self) -> bool {
        self.begun += 1;
        if self.begun <= self.trials {
            return self.begun > 1;
        }
        let [by_cost, farthest] = [self.tests[0] * self.rays[1], self.tests[1] * self.rays[0]];
        farthest * Self::FARTHEST_PERCENT < by_cost * 100
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_order_of_fewer_tests_at_its_price_is_chosen() {
        for (by_cost, farthest, expected) in [(100, 90, false), (100, 70, true), (0, 70, false), (80, 80, false)] {
            let mut order = Order::of_trials(4);
            let trials = [(); 4].map(|()| order.is_farthest_first());
            assert_eq!(trials, [false, true, true, true]);
            order.add(false, 64, by_cost);
            order.add(true, 64, farthest);
            assert_eq!(order.is_farthest_first(), expected, "{by_cost} and {farthest} tests");
            // Twice the rays with twice the tests change nothing.
            order.add(true, 128, 2 * farthest);
            assert_eq!(order.is_farthest_first(), expected);
        }
    }
}
