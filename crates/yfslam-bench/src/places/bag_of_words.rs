//! A bag of words with a trained vocabulary, for comparison with place recognition without one: a tree of cluster centres in Hamming
//! space, and the similarity of two images by the words that they share (Gálvez-López and Tardós, Bags of Binary Words, IEEE T-RO 2012).

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};
use yfslam::unstable::Descriptor;

/// Number of children of a node.
const BRANCHES: usize = 10;
/// Levels of the tree; 10⁵ words at most.
const LEVELS: usize = 5;
/// Rounds of clustering.
const ROUNDS: usize = 5;

/// A tree of words.
pub struct Vocabulary {
    nodes: Vec<Node>,
    /// Inverse document frequency of each word; 0 for nodes that are not words.
    weights: Vec<f64>,
}

#[derive(Default)]
struct Node {
    center: Descriptor,
    children: Vec<usize>,
}

/// The words of an image, ascending, with weights that sum to 1.
pub type Words = Vec<(usize, f64)>;

impl Vocabulary {
    /// Trains on the descriptors of some images.
    pub fn train(images: &[Vec<Descriptor>]) -> Self {
        let mut tree = Self { nodes: vec![Node::default()], weights: Vec::new() };
        let all = images.iter().flatten().copied().collect();
        tree.split(0, all, 1, &mut Pcg64Mcg::seed_from_u64(0));
        let mut seen_in = vec![0usize; tree.nodes.len()];
        for image in images {
            let mut words: Vec<usize> = image.iter().map(|d| tree.word(d)).collect();
            words.sort_unstable();
            words.dedup();
            words.into_iter().for_each(|word| seen_in[word] += 1);
        }
        let idf = |n: &usize| if *n > 0 { (images.len() as f64 / *n as f64).ln() } else { 0.0 };
        tree.weights = seen_in.iter().map(idf).collect();
        tree
    }

    /// Number of words.
    pub fn len(&self) -> usize {
        self.nodes.iter().filter(|node| node.children.is_empty()).count()
    }

    /// The words of an image.
    pub fn words(&self, descriptors: &[Descriptor]) -> Words {
        let mut found: Vec<usize> = descriptors.iter().map(|d| self.word(d)).collect();
        found.sort_unstable();
        let weigh = |same: &[usize]| (same[0], same.len() as f64 * self.weights[same[0]]);
        let mut words: Words = found.chunk_by(|a, b| a == b).map(weigh).filter(|word| word.1 > 0.0).collect();
        let sum: f64 = words.iter().map(|word| word.1).sum();
        words.iter_mut().for_each(|word| word.1 /= sum);
        words
    }

    /// The leaf of a descriptor.
    fn word(&self, descriptor: &Descriptor) -> usize {
        let mut at = 0;
        while let Some(&next) =
            self.nodes[at].children.iter().min_by_key(|&&child| descriptor.distance(&self.nodes[child].center))
        {
            at = next;
        }
        at
    }

    /// Clusters the descriptors of a node by k-majority, and continues with the clusters.
    fn split(&mut self, node: usize, members: Vec<Descriptor>, level: usize, rng: &mut Pcg64Mcg) {
        if members.len() <= BRANCHES || level > LEVELS {
            return;
        }
        let mut centers: Vec<Descriptor> =
            (0..BRANCHES).map(|_| members[rng.next_u64() as usize % members.len()]).collect();
        let nearest = |centers: &[Descriptor], d: &Descriptor| {
            (0..centers.len()).min_by_key(|&c| d.distance(&centers[c])).unwrap_or_default()
        };
        for _ in 0..ROUNDS {
            let mut ones = vec![[0i32; 256]; centers.len()];
            for member in &members {
                let bits = &mut ones[nearest(&centers, member)];
                (0..256).for_each(|b| bits[b] += if member.0[b / 64] >> (b % 64) & 1 == 1 { 1 } else { -1 });
            }
            for (center, bits) in centers.iter_mut().zip(&ones).filter(|(_, bits)| bits.iter().any(|b| *b != 0)) {
                *center = Descriptor::default();
                (0..256).filter(|&b| bits[b] > 0).for_each(|b| center.0[b / 64] |= 1 << (b % 64));
            }
        }
        let mut clusters = vec![Vec::new(); centers.len()];
        members.into_iter().for_each(|member| clusters[nearest(&centers, &member)].push(member));
        for (center, cluster) in centers.into_iter().zip(clusters).filter(|(_, cluster)| !cluster.is_empty()) {
            let child = self.nodes.len();
            self.nodes.push(Node { center, children: Vec::new() });
            self.nodes[node].children.push(child);
            self.split(child, cluster, level + 1, rng);
        }
    }
}

/// Similarity of two images, in [0, 1]: 1 minus half of the sum of the differences.
pub fn similarity(a: &Words, b: &Words) -> f64 {
    let (mut i, mut j, mut shared) = (0, 0, 0.0);
    while let (Some(p), Some(q)) = (a.get(i), b.get(j)) {
        if p.0 == q.0 {
            shared += p.1.min(q.1);
        }
        i += usize::from(p.0 <= q.0);
        j += usize::from(q.0 <= p.0);
    }
    shared
}
