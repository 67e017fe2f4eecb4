// A tape of packets: the record of one evaluation of the shading code, for reverse-mode and forward-mode
// automatic differentiation (Griewank and Walther 2008, "Evaluating Derivatives", chapters 3 and 6).
//
// A tape is a list of edges (from, to, partial): the number `to` was computed from the number `from`, and
// `partial` is its derivative by it, one per lane. The edges are in the order of evaluation. A backward sweep
// runs from the last edge to the first and adds partial * adjoint(to) to adjoint(from). A forward sweep runs
// from the first to the last and adds partial * tangent(from) to tangent(to).
//
// A block replaces many edges by a few vectors and hand-written derivatives. It has a position among the
// edges.
//
// Numbers that are read from a differentiable table are leaves. A backward sweep adds their adjoints to the
// table's gradient at the positions that were read. A forward sweep starts from the table's tangent there.
// The adjoint of a gather is a scatter, so that both sweeps are transposes of each other by construction.
//
// A lane whose adjoint is zero contributes nothing, even if a partial is infinite or NaN. Lanes that were
// computed but not selected may hold such partials.
#pragma once

#include "scene/differentiable_tables.h"
#include "simd/lanes.h"
#include "util/tape_memory.h"

// Static thread-local storage is accessed by one instruction; that of a shared library needs a call.
#if defined(__linux__)
#define EG_FAST_THREAD_LOCAL __attribute__((tls_model("initial-exec")))
#else
#define EG_FAST_THREAD_LOCAL
#endif

namespace edgegrad::EDGEGRAD_ADJOINT_ISA {

namespace raw = edgegrad::EDGEGRAD_ISA;

// Nodes of consecutive floats. Those with the numbers `low` <= k < `high` have nodes.
struct LeafNodes {
    int32_t first = 0;  // node of the float number 0
    int low = 0, high = 0;

    int32_t operator[](int k) const { return k >= low && k < high ? first + k : -1; }
};

class Tape {
 public:
    // Makes this tape the one that this thread's numbers are recorded on.
    Tape(TapeMemory& memory, const DifferentiableTables& tables);
    ~Tape();
    Tape(const Tape&) = delete;
    Tape& operator=(const Tape&) = delete;

    // Starts a new recording.
    void clear() {
        edges_ = nodes_ = leaves_ = zeroed_ = blocks_ = 0, block_bytes_ = 0;
        first_ = {};
    }
    // A recording may consist of independent parts, each with its own node numbers. A part consists of what
    // was recorded since the previous part. It can be swept by itself once all parts are recorded.
    struct Place {
        int edges = 0, closures = 0, blocks = 0;
    };
    Place place() const { return {edges_, leaves_, blocks_}; }
    void new_part() { nodes_ = zeroed_ = 0; }
    void reopen(const Place& first, const Place& last, int nodes) {
        first_ = first;
        edges_ = last.edges, leaves_ = last.closures, blocks_ = last.blocks;
        nodes_ = nodes, zeroed_ = 0;
    }

    // ---- Recording (adjoint/number.h) ----

    int32_t new_node() { return nodes_++; }

    // Makes a node that depends on others (negative: on a constant; no edge is made). This is called very
    // often, so inlining would fill the instruction cache.
    __attribute__((noinline)) int32_t record(int32_t a, raw::Float pa) {
        reserve();
        ends_[edges_] = {a, nodes_};
        partials_[edges_++] = pa;
        return nodes_++;
    }
    template <typename... Edges>
    __attribute__((noinline)) int32_t record(int32_t a, raw::Float pa, int32_t b, raw::Float pb,
                                             Edges... rest) {
        static_assert(2 + sizeof...(rest) / 2 <= kMostEdges);
        reserve();
        int e = edges_;
        add_edges(e, a, pa, b, pb, rest...);
        edges_ = e;
        return nodes_++;
    }
    int32_t record(int count, const int32_t* from, const raw::Float* partials) {
        for (int k = 0; k < count; ++k) {
            reserve();
            add_edge(edges_, from[k], partials[k]);
        }
        return nodes_++;
    }

    // Makes a block: several results of several numbers with hand-written derivatives (adjoint/blocks.h). A
    // block is a plain struct. Its `first` is the node of the first of its kResults results, and it has the
    // functions
    //   backward(d): adds to the adjoints of its operands,
    //   forward(d): sets the tangents of its results, which were zero.
    // The caller must fill in the other fields before it records anything else.
    template <typename Block>
    Block& new_block() {
        constexpr size_t size = (sizeof(Block) + 63) / 64 * 64;
        auto& block = *static_cast<Block*>(make_block(
            size, [](const void* b, raw::Float* d) { static_cast<const Block*>(b)->backward(d); },
            [](const void* b, raw::Float* d) { static_cast<const Block*>(b)->forward(d); }));
        block.first = nodes_;
        nodes_ += Block::kResults;
        return block;
    }

    // Makes leaves for `count` consecutive floats from base + index on, for each lane. Makes none if no lane
    // reads from a requested span.
    LeafNodes record_closures(const float* base, raw::Int index, int count);

    // ---- Sweeps ----

    // Adds to the adjoint of an output before a backward sweep, or to the tangent of an input before a
    // forward sweep.
    void seed(int32_t node, raw::Float value);
    // Returns the lanes in which the adjoint of a table's number is not finite. It is left out of the
    // gradient.
    raw::Mask backward();
    void forward();
    // Returns an adjoint or a tangent after a sweep.
    raw::Float derivative(int32_t node) const;

    // The requested derivatives by distance fields, which blocks read and add to.
    const FieldDerivatives& fields() const { return tables_.fields; }

    int edge_count() const { return edges_; }
    int node_count() const { return nodes_; }

 private:
    struct Ends {
        int32_t from, to;
    };
    struct Leaves {
        raw::Int place;  // position in the table's span; -1: outside
        int32_t node, count, table;
    };
    using BlockSweep = void (*)(const void*, raw::Float*);
    struct BlockEntry {
        size_t at;      // offset in the blocks' memory
        int32_t edges;  // number of edges recorded before it
        BlockSweep backward, forward;
    };
    // Largest number of edges that one call of `record` makes.
    static constexpr int kMostEdges = 6;

    inline __attribute__((always_inline)) void reserve() {
        if (__builtin_expect(edges_ + kMostEdges > edge_room_, 0)) grow_edges();
    }
    inline __attribute__((always_inline)) void add_edge(int& e, int32_t from, raw::Float partial) {
        ends_[e] = {from, nodes_};
        partials_[e] = partial;
        e += from >= 0;
    }
    template <typename... Edges>
    inline __attribute__((always_inline)) void add_edges(int& e, int32_t from, raw::Float partial,
                                                         Edges... rest) {
        add_edge(e, from, partial);
        if constexpr (sizeof...(rest) > 0) add_edges(e, rest...);
    }
    __attribute__((cold)) void grow_edges();
    void* make_block(size_t size, BlockSweep backward, BlockSweep forward);
    void sweep_back(raw::Float* d, int last, int first) const;
    void sweep_on(raw::Float* d, int first, int last) const;
    raw::Mask scatter(const Leaves& closures, const raw::Float* adjoint) const;
    // Derivatives of all nodes. Those of nodes made since the last sweep are set to zero.
    raw::Float* derivatives();

    Ends* ends_ = nullptr;
    raw::Float* partials_ = nullptr;
    int edges_ = 0, edge_room_ = 0;
    int nodes_ = 0, leaves_ = 0, zeroed_ = 0, blocks_ = 0;
    size_t block_bytes_ = 0;
    Place first_;  // start of the part that is swept
    const DifferentiableTables& tables_;
    uintptr_t lowest_ = ~uintptr_t{0}, highest_ = 0;  // address range of all tables
    TapeMemory& memory_;
    Tape* outer_;
};

inline thread_local constinit Tape* current_tape EG_FAST_THREAD_LOCAL = nullptr;

inline Tape::Tape(TapeMemory& memory, const DifferentiableTables& tables)
    : tables_(tables), memory_(memory), outer_(current_tape) {
    for (int t = 0; t < tables.count; ++t) {
        const uintptr_t begin = reinterpret_cast<uintptr_t>(tables.table[t].begin),
                        end = reinterpret_cast<uintptr_t>(tables.table[t].end);
        lowest_ = begin < lowest_ ? begin : lowest_;
        highest_ = end > highest_ ? end : highest_;
    }
    ends_ = static_cast<Ends*>(memory.ends.data());
    partials_ = static_cast<raw::Float*>(memory.partials.data());
    const size_t room = memory.ends.size() / sizeof(Ends), more = memory.partials.size() / sizeof(raw::Float);
    edge_room_ = static_cast<int>(room < more ? room : more);
    current_tape = this;
}

inline Tape::~Tape() { current_tape = outer_; }

inline void Tape::grow_edges() {
    const size_t kept = static_cast<size_t>(edges_), room = 2 * kept + 4096;
    ends_ = static_cast<Ends*>(memory_.ends.grow(room * sizeof(Ends), kept * sizeof(Ends)));
    partials_ =
        static_cast<raw::Float*>(memory_.partials.grow(room * sizeof(raw::Float), kept * sizeof(raw::Float)));
    edge_room_ = static_cast<int>(room);
}

inline LeafNodes Tape::record_closures(const float* base, raw::Int index, int count) {
    const auto address = [](const float* p) { return reinterpret_cast<uintptr_t>(p); };
    if (address(base) < lowest_ || address(base) >= highest_) return {};
    for (int t = 0; t < tables_.count; ++t) {
        const DifferentiableTable& table = tables_.table[t];
        if (address(base) < address(table.begin) || address(base) >= address(table.end)) continue;
        const raw::Int place = index + static_cast<int32_t>(base - table.first);
        const int32_t size = static_cast<int32_t>(table.last - table.first);
        const raw::Mask inside = (place >= 0) & (place <= size - count);
        if (!raw::any(inside)) return {};
        int low = 0, high = count;
        if (table.width > 1) {
            // Use the range from the first requested column to the last; reads stay within rows.
            const uint64_t requested = table.columns >> ((base - table.begin) % table.width);
            while (low < high && !(requested >> low & 1)) ++low;
            while (low < high && !(requested >> (high - 1) & 1)) --high;
            if (low == high) return {};
        }
        Leaves* closures = static_cast<Leaves*>(memory_.closures.data());
        const size_t used = static_cast<size_t>(leaves_) * sizeof(Leaves);
        if (used + sizeof(Leaves) > memory_.closures.size())
            closures = static_cast<Leaves*>(memory_.closures.grow(2 * used + 64 * sizeof(Leaves), used));
        closures[leaves_++] = {raw::select(inside, place + low, raw::splat(-1)), nodes_, high - low, t};
        nodes_ += high - low;
        return {nodes_ - high, low, high};
    }
    return {};
}

inline void* Tape::make_block(size_t size, BlockSweep backward, BlockSweep forward) {
    const size_t used = static_cast<size_t>(blocks_) * sizeof(BlockEntry);
    if (used + sizeof(BlockEntry) > memory_.block_entries.size())
        memory_.block_entries.grow(2 * used + 64 * sizeof(BlockEntry), used);
    if (block_bytes_ + size > memory_.blocks.size())
        memory_.blocks.grow(2 * (block_bytes_ + size) + 65536, block_bytes_);
    static_cast<BlockEntry*>(memory_.block_entries.data())[blocks_++] = {block_bytes_, edges_, backward,
                                                                         forward};
    void* block = static_cast<char*>(memory_.blocks.data()) + block_bytes_;
    block_bytes_ += size;
    return block;
}

inline raw::Float* Tape::derivatives() {
    const size_t size = static_cast<size_t>(nodes_), kept = static_cast<size_t>(zeroed_);
    auto* d = static_cast<raw::Float*>(
        memory_.derivatives.grow(size * sizeof(raw::Float), kept * sizeof(raw::Float)));
    for (; zeroed_ < nodes_; ++zeroed_) d[zeroed_] = raw::splat(0.0f);
    return d;
}

inline void Tape::seed(int32_t node, raw::Float value) {
    if (node < 0) return;
    raw::Float& d = derivatives()[node];
    d = d + value;
}

inline raw::Float Tape::derivative(int32_t node) const {
    if (node < 0 || node >= zeroed_) return raw::splat(0.0f);
    return static_cast<const raw::Float*>(memory_.derivatives.data())[node];
}

inline void Tape::sweep_back(raw::Float* d, int last, int first) const {
    for (int e = last - 1; e >= first; --e) {
        const raw::Float g = d[ends_[e].to];
        raw::Float& from = d[ends_[e].from];
        from = from + raw::select(g != 0.0f, partials_[e] * g, 0.0f);
    }
}

inline raw::Mask Tape::backward() {
    raw::Float* d = derivatives();
    const auto* entries = static_cast<const BlockEntry*>(memory_.block_entries.data());
    int e = edges_;
    for (int k = blocks_ - 1; k >= first_.blocks; --k) {
        sweep_back(d, e, entries[k].edges);
        e = entries[k].edges;
        entries[k].backward(static_cast<const char*>(memory_.blocks.data()) + entries[k].at, d);
    }
    sweep_back(d, e, first_.edges);
    const Leaves* closures = static_cast<const Leaves*>(memory_.closures.data());
    raw::Mask lost = raw::splat(0);
    for (int k = first_.closures; k < leaves_; ++k) lost |= scatter(closures[k], d + closures[k].node);
    return lost;
}

// Returns the lanes whose adjoint is not finite.
inline raw::Mask Tape::scatter(const Leaves& closures, const raw::Float* adjoint) const {
    double* gradient = tables_.table[closures.table].gradient;
    raw::Mask left = adjoint[0] != 0.0f, finite = adjoint[0] - adjoint[0] == 0.0f;
    for (int c = 1; c < closures.count; ++c) {
        left |= adjoint[c] != 0.0f;
        finite &= adjoint[c] - adjoint[c] == 0.0f;
    }
    left &= closures.place >= 0;
    const raw::Mask lost = left & ~finite;
    left &= finite;
    while (raw::any(left)) {
        const int lane = raw::first_lane(left);
        double* to = gradient + closures.place[lane];
        const raw::Mask same = left & (closures.place == closures.place[lane]);
        left &= ~same;
        if (!raw::any(same & (raw::lane_index() != lane))) {
            for (int c = 0; c < closures.count; ++c) to[c] += static_cast<double>(adjoint[c][lane]);
            continue;
        }
        // Lanes that read the same position are summed first, because consecutive additions to one address
        // wait for each other.
        for (int c = 0; c < closures.count; ++c) {
            const raw::Float a = raw::select(same, adjoint[c], 0.0f);
            if (raw::any(a != 0.0f)) to[c] += raw::sum_of_lanes(a);
        }
    }
    return lost;
}

inline void Tape::forward() {
    raw::Float* d = derivatives();
    const Leaves* closures = static_cast<const Leaves*>(memory_.closures.data());
    for (int k = first_.closures; k < leaves_; ++k) {
        const Leaves& closure = closures[k];
        const double* tangent = tables_.table[closure.table].tangent;
        for (int i = 0; i < raw::W; ++i) {
            const int32_t place = closure.place[i];
            if (place < 0) continue;
            for (int c = 0; c < closure.count; ++c)
                d[closure.node + c][i] += static_cast<float>(tangent[place + c]);
        }
    }
    const auto* entries = static_cast<const BlockEntry*>(memory_.block_entries.data());
    int e = first_.edges;
    for (int k = first_.blocks; k < blocks_; ++k) {
        sweep_on(d, e, entries[k].edges);
        e = entries[k].edges;
        entries[k].forward(static_cast<const char*>(memory_.blocks.data()) + entries[k].at, d);
    }
    sweep_on(d, e, edges_);
}

inline void Tape::sweep_on(raw::Float* d, int first, int last) const {
    for (int e = first; e < last; ++e) {
        const raw::Float t = d[ends_[e].from], p = partials_[e];
        raw::Float& to = d[ends_[e].to];
        to = to + raw::select((t != 0.0f) & (p != 0.0f), p * t, 0.0f);
    }
}

}  // namespace edgegrad::EDGEGRAD_ADJOINT_ISA
