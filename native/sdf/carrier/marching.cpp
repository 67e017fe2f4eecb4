#include "sdf/carrier/marching.h"

#include <algorithm>
#include <utility>

#include "sdf/bricks/coefficient_blocks.h"
#include "sdf/outline_point.h"
#include "util/parallel.h"

namespace edgegrad {
namespace {

// A cell is cut into the six tetrahedra of the paths along its edges from its first to its last corner.
// Neighbouring cells then cut their common face alike.
constexpr int kPaths[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};

// The nodes of one slab across the first axis that are asked for: the values of the spline, and the vertices
// on the edges that begin there. A field has few such nodes, near its surface.
class NodeSlab {
 public:
    struct Entry {
        size_t place;  // of the node
        double value;
        std::array<int64_t, 7> vertex;  // by the direction of the edge; -1: none yet
    };

    NodeSlab(const FieldView& f, int first, int parts)
        : f_(&f),
          first_(first),
          parts_(parts),
          columns_(f.cells(2) * parts + 1),
          place_((static_cast<size_t>(f.cells(1)) * static_cast<size_t>(parts) + 1) *
                     static_cast<size_t>(columns_),
                 -1) {}

    // The node (first, j, k). Another node's entry may move.
    Entry& operator()(int j, int k) {
        const size_t at = static_cast<size_t>(j) * static_cast<size_t>(columns_) + static_cast<size_t>(k);
        int32_t& place = place_[at];
        if (place < 0) {
            place = static_cast<int32_t>(entries_.size());
            entries_.push_back({at, value(j, k), {-1, -1, -1, -1, -1, -1, -1}});
        }
        return entries_[static_cast<size_t>(place)];
    }

    // Forgets all nodes, and goes on to the slab `first`.
    void move_to(int first) {
        for (const Entry& entry : entries_) place_[entry.place] = -1;
        entries_.clear();
        first_ = first;
    }

 private:
    double value(int j, int k) const {
        if (parts_ == 1) return value_at_corner(j, k);
        const double part = 1.0 / parts_, grid[3] = {first_ * part, j * part, k * part};
        return spline_value(*f_, grid);
    }

    // At corners of cells the weights along each axis are 1/6, 4/6 and 1/6.
    double value_at_corner(int j, int k) const {
        const auto mean = [](double a, double b, double c) { return (a + 4.0 * b + c) / 6.0; };
        const int64_t row = f_->size[2], slab = row * f_->size[1];
        const float* c = f_->values + first_ * slab + j * row + k;
        double along[3];
        for (int n = 0; n < 3; ++n, ++c) {
            double across[3];
            for (int m = 0; m < 3; ++m) {
                const float* at = c + m * row;
                across[m] = mean(double{at[0]}, double{at[slab]}, double{at[2 * slab]});
            }
            along[n] = mean(across[0], across[1], across[2]);
        }
        return mean(along[0], along[1], along[2]);
    }

    const FieldView* f_;
    int first_, parts_, columns_;
    std::vector<int32_t> place_;  // among the entries; -1: not asked for yet
    std::vector<Entry> entries_;
};

// The cells of one slab of bricks whose coefficients have both signs. In all others the nodes have one sign,
// because their values are convex combinations of coefficients. Blocks of one sign are not read, so that the
// time grows with the surface.
class MixedCells {
 public:
    explicit MixedCells(const FieldView& f) : f_(f), blocks_(f.size) {}

    // Reads the slab of the cells [8 slab, 8 (slab + 1)).
    void read(int slab) {
        bricks_.clear();
        for (int j = 0; kBrickCells * j < f_.cells(1); ++j)
            for (int k = 0; kBrickCells * k < f_.cells(2); ++k) {
                uint8_t all = kPositiveBlock | kNegativeBlock;
                for (int corner = 0; corner < 8; ++corner)
                    all &= f_.signs[blocks_.read_by_brick(slab, j, k, corner)];
                if (all == 0) add({kBrickCells * slab, kBrickCells * j, kBrickCells * k});
            }
    }

    // Visits the mixed cells with the place `i` along the first axis, in order.
    template <typename Visit>
    void each(int i, const Visit& visit) const {
        for (size_t first = 0, last; first < bricks_.size(); first = last) {
            const Cell& at = bricks_[first].first;
            for (last = first; last < bricks_.size() && bricks_[last].first[1] == at[1];) ++last;
            for (int j = 0; j < kBrickCells; ++j)
                for (size_t n = first; n < last; ++n) {
                    uint32_t bits = bricks_[n].mixed[i - at[0]][j];
                    for (int k = bricks_[n].first[2]; bits != 0; bits >>= 1, ++k)
                        if (bits & 1) visit(Cell{i, at[1] + j, k});
                }
        }
    }

 private:
    static constexpr int kTaps = 4;  // coefficients of a cell along an axis
    struct Brick {
        Cell first;
        uint8_t mixed[kBrickCells][kBrickCells];  // the cells of a row as bits
    };

    void add(const Cell& first) {
        constexpr int kReach = kBrickCells + kTaps - 1;
        const int64_t row = f_.size[2], slab = row * f_.size[1];
        int count[3];  // of cells
        for (int a = 0; a < 3; ++a)
            count[a] = std::min(kBrickCells, f_.cells(a) - first[static_cast<size_t>(a)]);
        // Bits of the cells that read a coefficient of each sign, by the row of their first coefficient
        uint32_t along[2][kReach][kReach];
        for (int i = 0; i < count[0] + kTaps - 1; ++i)
            for (int j = 0; j < count[1] + kTaps - 1; ++j) {
                const float* c = f_.values + (first[0] + i) * slab + (first[1] + j) * row + first[2];
                uint32_t below = 0;
                for (int k = 0; k < count[2] + kTaps - 1; ++k)
                    below |= static_cast<uint32_t>(c[k] < 0.0f) << k;
                const uint32_t above = ~below & ((1u << (count[2] + kTaps - 1)) - 1u);
                along[0][i][j] = below | below >> 1 | below >> 2 | below >> 3;
                along[1][i][j] = above | above >> 1 | above >> 2 | above >> 3;
            }
        Brick brick{first, {}};
        bool any = false;
        for (int i = 0; i < count[0]; ++i)
            for (int j = 0; j < count[1]; ++j) {
                uint32_t some[2] = {0, 0};
                for (int side = 0; side < 2; ++side)
                    for (int a = 0; a < kTaps; ++a)
                        for (int b = 0; b < kTaps; ++b) some[side] |= along[side][i + a][j + b];
                brick.mixed[i][j] = static_cast<uint8_t>(some[0] & some[1] & ((1u << count[2]) - 1u));
                any = any || brick.mixed[i][j] != 0;
            }
        if (any) bricks_.push_back(brick);
    }

    const FieldView& f_;
    BlockGrid blocks_;
    std::vector<Brick> bricks_;  // of the slab, in order
};

// Collects the triangles of the slabs of cells one after the other, with vertices on the edges of tetrahedra.
class March {
 public:
    March(const FieldView& f, int parts, FieldCarrier& out)
        : out_(out), parts_(parts), low_(f, 0, parts), high_(f, 1, parts) {}

    // Moves on to the nodes before and behind slab i.
    void slab(int i) {
        may_cancel();
        if (i == at_ + 1) {
            std::swap(low_, high_);
            high_.move_to(i + 1);
        } else if (i != at_) {
            low_.move_to(i), high_.move_to(i + 1);
        }
        at_ = i;
    }

    // Returns whether the corners of a part of a cell differ in their signs.
    bool part(const Cell& at) {
        int inside = 0;
        for (int c = 0; c < 8; ++c) inside += value({c & 1, c >> 1 & 1, c >> 2}, at) < 0.0;
        if (inside == 0 || inside == 8) return false;
        for (const auto& path : kPaths) {
            Cell corner[4] = {};
            for (int k = 0; k < 3; ++k) {
                corner[k + 1] = corner[k];
                corner[k + 1][static_cast<size_t>(path[k])] = 1;
            }
            tetrahedron(at, corner);
        }
        return true;
    }

 private:
    NodeSlab::Entry& node(const Cell& corner, const Cell& at) {
        return (corner[0] ? high_ : low_)(at[1] + corner[1], at[2] + corner[2]);
    }
    double value(const Cell& corner, const Cell& at) { return node(corner, at).value; }

    // The vertex on the edge between two corners of a part of a cell.
    uint32_t vertex(const Cell& at, const Cell& from, const Cell& to) {
        const int direction = (to[0] - from[0]) + 2 * (to[1] - from[1]) + 4 * (to[2] - from[2]);
        const double a = value(from, at), b = value(to, at), part = a / (a - b);
        int64_t& known = node(from, at).vertex[static_cast<size_t>(direction - 1)];
        if (known >= 0) return static_cast<uint32_t>(known);
        known = static_cast<int64_t>(out_.point.size() / 3);
        for (size_t k = 0; k < 3; ++k)
            out_.point.push_back((at[k] + from[k] + part * (to[k] - from[k])) / parts_);
        return static_cast<uint32_t>(known);
    }

    void tetrahedron(const Cell& at, const Cell (&corner)[4]) {
        int in[4], out[4], ins = 0, outs = 0;
        for (int k = 0; k < 4; ++k) (value(corner[k], at) < 0.0 ? in[ins++] : out[outs++]) = k;
        if (ins == 0 || outs == 0) return;
        const auto edge = [&](int a, int b) { return std::pair{std::min(a, b), std::max(a, b)}; };
        if (ins == 1) {
            triangle(at, corner, edge(in[0], out[0]), edge(in[0], out[1]), edge(in[0], out[2]), in[0]);
        } else if (outs == 1) {
            triangle(at, corner, edge(out[0], in[0]), edge(out[0], in[1]), edge(out[0], in[2]), in[0]);
        } else {
            const auto a = edge(in[0], out[0]), b = edge(in[0], out[1]), c = edge(in[1], out[1]),
                       d = edge(in[1], out[0]);
            triangle(at, corner, a, b, c, in[0]);
            triangle(at, corner, a, c, d, in[0]);
        }
    }

    // Adds a triangle whose back faces the corner `behind`. The middles of the edges decide on that, without
    // rounding.
    void triangle(const Cell& at, const Cell (&corner)[4], std::pair<int, int> a, std::pair<int, int> b,
                  std::pair<int, int> c, int behind) {
        const auto middle = [&](std::pair<int, int> e, size_t k) {
            return corner[e.first][k] + corner[e.second][k];
        };
        int u[3], v[3], w[3];
        for (size_t k = 0; k < 3; ++k) {
            u[k] = middle(b, k) - middle(a, k), v[k] = middle(c, k) - middle(a, k);
            w[k] = 2 * corner[behind][k] - middle(a, k);
        }
        const int volume = w[0] * (u[1] * v[2] - u[2] * v[1]) + w[1] * (u[2] * v[0] - u[0] * v[2]) +
                           w[2] * (u[0] * v[1] - u[1] * v[0]);
        if (volume > 0) std::swap(b, c);
        for (const auto& e : {a, b, c})
            out_.triangle.push_back(vertex(at, corner[e.first], corner[e.second]));
    }

    FieldCarrier& out_;
    int parts_, at_ = 0;
    NodeSlab low_, high_;  // nodes before and behind the slab
};

}  // namespace

void march_cells(const FieldView& field, const SkipCell& skips, const VisitCell& visit, FieldCarrier& out) {
    MixedCells mixed(field);
    March march(field, 1, out);
    for (int i = 0; i < field.cells(0); ++i) {
        if (i % kBrickCells == 0) mixed.read(i / kBrickCells);
        march.slab(i);
        mixed.each(i, [&](const Cell& cell) {
            if (!skips(cell)) visit(cell, march.part(cell));
        });
    }
}

void march_parts(const FieldView& field, const std::vector<Cell>& cells, int parts, FieldCarrier& out) {
    March march(field, parts, out);
    for (size_t first = 0, last; first < cells.size(); first = last) {
        for (last = first; last < cells.size() && cells[last][0] == cells[first][0];) ++last;
        for (int i = parts * cells[first][0]; i < parts * (cells[first][0] + 1); ++i) {
            march.slab(i);
            for (size_t n = first; n < last; ++n)
                for (int j = 0; j < parts; ++j)
                    for (int k = 0; k < parts; ++k)
                        march.part({i, parts * cells[n][1] + j, parts * cells[n][2] + k});
        }
    }
}

}  // namespace edgegrad
