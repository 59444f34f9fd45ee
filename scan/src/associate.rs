//! Which robot is which: the probability of every pair, over all ways in which robots and what was seen can belong together.
//!
//! A robot is seen once or not at all, and what is seen is one robot or none of the team. A way is as likely as the product of its parts:
//! `w` of a pair (how well it fits, over how often something else looks like that), and `1 − p` of a robot that is not seen. An identity
//! is said if the sum over all ways says that nobody else can be meant.

/// A pair that may belong together.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Pair {
    /// Place of the robot.
    pub robot: usize,
    /// Place of what was seen, below 64.
    pub seen: usize,
    /// How well they fit, over how often something else looks like that.
    pub weight: f64,
}

/// What a pair was found to be.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Odds {
    /// That they belong together.
    pub own: f64,
    /// That what was seen is another robot of the team.
    pub others: f64,
}

/// Ways that are looked at of one cluster; of more, none is sure.
const MOST_WAYS: usize = 4096;

/// Works out the odds of pairs, with memory of its own.
#[derive(Debug)]
pub struct Associator {
    most_robots: usize,
    /// Of each robot: the cluster it is in, named by its first robot.
    cluster: Vec<usize>,
    members: Vec<usize>,
    order: Vec<usize>,
    starts: Vec<usize>,
    sums: Vec<f64>,
    misses: Vec<f64>,
    scales: Vec<f64>,
    taken: Vec<f64>,
}

impl Associator {
    /// For so many robots and pairs at once.
    #[must_use]
    pub fn new(most_robots: usize, most_pairs: usize) -> Self {
        Self {
            most_robots,
            cluster: Vec::with_capacity(most_robots),
            members: Vec::with_capacity(most_robots),
            order: Vec::with_capacity(most_pairs),
            starts: Vec::with_capacity(most_robots + 1),
            sums: Vec::with_capacity(most_pairs),
            misses: Vec::with_capacity(most_robots),
            scales: Vec::with_capacity(most_robots),
            taken: vec![0.0; 64],
        }
    }

    /// The odds of each pair, into `odds`, and the logarithm of the sum over all ways. `missed` is the probability that a robot is not seen. Pairs of robots beyond those that
    /// there is room for are passed over.
    pub fn work_out(
        &mut self,
        robots: usize,
        pairs: &[Pair],
        missed: f64,
        odds: &mut Vec<Odds>,
    ) -> f64 {
        let robots = robots.min(self.most_robots);
        odds.clear();
        odds.resize(pairs.len().min(odds.capacity()), Odds::default());
        let pairs = &pairs[..odds.len().min(self.order.capacity())];
        self.sort(robots, pairs, missed);
        let mut evidence = -self.scales.iter().map(|it| it.ln()).sum::<f64>();
        for first in 0..robots {
            if self.cluster[first] == first {
                evidence += self.cluster_odds(first, robots, pairs, odds);
            }
        }
        self.sum_others(pairs, odds);
        evidence
    }

    /// The pairs of each robot one after another, and which robots hang together.
    fn sort(&mut self, robots: usize, pairs: &[Pair], missed: f64) {
        self.order.clear();
        self.starts.clear();
        self.cluster.clear();
        self.cluster.extend(0..robots);
        self.misses.clear();
        self.scales.clear();
        for robot in 0..robots {
            self.starts.push(self.order.len());
            let own = pairs
                .iter()
                .enumerate()
                .filter(|(_, pair)| pair.robot == robot);
            self.order.extend(own.map(|(place, _)| place));
            // Scaled so that no product is too large for a number.
            let weights = pairs
                .iter()
                .filter(|pair| pair.robot == robot)
                .map(|it| it.weight);
            let scale = weights.fold(missed, f64::max);
            self.misses.push(missed / scale);
            self.scales.push(1.0 / scale);
        }
        self.starts.push(self.order.len());
        self.sums.clear();
        self.sums.resize(pairs.len(), 0.0);
        for (place, one) in pairs.iter().enumerate() {
            for other in &pairs[..place] {
                if one.seen == other.seen && one.robot.max(other.robot) < robots {
                    self.join(one.robot, other.robot);
                }
            }
        }
    }

    fn join(&mut self, one: usize, other: usize) {
        let (one, other) = (self.cluster[one], self.cluster[other]);
        let (low, high) = (one.min(other), one.max(other));
        for cluster in &mut self.cluster {
            if *cluster == high {
                *cluster = low;
            }
        }
    }

    /// The logarithm of the sum over the ways of one cluster; nothing of one that has too many.
    fn cluster_odds(
        &mut self,
        first: usize,
        robots: usize,
        pairs: &[Pair],
        odds: &mut [Odds],
    ) -> f64 {
        self.members.clear();
        let members = (0..robots).filter(|robot| self.cluster[*robot] == first);
        self.members.extend(members);
        let mut left = MOST_WAYS;
        let total = self.ways(0, 0, 1.0, pairs, &mut left);
        if left == 0 || !total.is_normal() {
            // Too many to be sure of any: all of them are somebody else's.
            for member in 0..self.members.len() {
                for place in self.pairs_of(self.members[member]) {
                    odds[self.order[place]] = Odds {
                        own: 0.0,
                        others: 1.0,
                    };
                }
            }
            return 0.0;
        }
        for member in 0..self.members.len() {
            for place in self.pairs_of(self.members[member]) {
                let pair = self.order[place];
                odds[pair].own = self.sums[pair] / total;
            }
        }
        total.ln()
    }

    fn pairs_of(&self, robot: usize) -> std::ops::Range<usize> {
        self.starts[robot]..self.starts[robot + 1]
    }

    /// Sum over all ways of the members from `depth` on, where `used` is taken; each pair gets what goes through it.
    fn ways(
        &mut self,
        depth: usize,
        used: u64,
        before: f64,
        pairs: &[Pair],
        left: &mut usize,
    ) -> f64 {
        let Some(robot) = self.members.get(depth).copied() else {
            *left = left.saturating_sub(1);
            return 1.0;
        };
        if *left == 0 {
            return 0.0;
        }
        let miss = self.misses[robot];
        let mut total = miss * self.ways(depth + 1, used, before * miss, pairs, left);
        for place in self.pairs_of(robot) {
            let pair = self.order[place];
            let bit = 1 << pairs[pair].seen;
            if used & bit != 0 {
                continue;
            }
            let weight = pairs[pair].weight * self.scales[robot];
            let through = weight * self.ways(depth + 1, used | bit, before * weight, pairs, left);
            self.sums[pair] += before * through;
            total += through;
        }
        total
    }

    fn sum_others(&mut self, pairs: &[Pair], odds: &mut [Odds]) {
        self.taken.fill(0.0);
        for (pair, odds) in pairs.iter().zip(odds.iter()) {
            self.taken[pair.seen] += odds.own;
        }
        for (pair, odds) in pairs.iter().zip(odds.iter_mut()) {
            odds.others = odds.others.max(self.taken[pair.seen] - odds.own);
        }
    }
}
