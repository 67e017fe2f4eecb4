#include "sdf/outline.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "util/parallel.h"

namespace edgegrad {
namespace {

using Point = std::array<double, 3>;
using Node = std::array<int, 3>;

constexpr int64_t kBlock = 1024;

// A cell is cut into the six tetrahedra of the paths along its edges from its first to its last corner.
// Neighbouring cells then cut their common face alike.
constexpr int kPaths[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};

// The nodes of one slab across the first axis that are asked for: the values of the spline, and the vertices
// on the edges that begin there. A field has few such nodes, near its surface.
class NodeSlab {
 public:
    struct Entry {
        double value;
        std::array<int64_t, 7> vertex;  // by the direction of the edge; -1: none yet
    };

    NodeSlab(const FieldView& f, int first)
        : f_(&f),
          first_(first),
          columns_(f.cells(2) + 1),
          place_(static_cast<size_t>((f.cells(1) + 1) * columns_), -1) {}

    // The node (first, j, k). Another node's entry may move.
    Entry& operator()(int j, int k) {
        int32_t& place = place_[static_cast<size_t>(j * columns_ + k)];
        if (place < 0) {
            place = static_cast<int32_t>(entries_.size());
            entries_.push_back({value(j, k), {-1, -1, -1, -1, -1, -1, -1}});
        }
        return entries_[static_cast<size_t>(place)];
    }

 private:
    // At nodes the weights along each axis are 1/6, 4/6 and 1/6.
    double value(int j, int k) const {
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
    int first_, columns_;
    std::vector<int32_t> place_;  // among the entries; -1: not asked for yet
    std::vector<Entry> entries_;
};

// The cells of one slab whose coefficients have both signs. In all others the nodes have one sign, because
// their values are convex combinations of coefficients.
class MixedCells {
 public:
    explicit MixedCells(const FieldView& f) : f_(f), rows_(f.size[1]), taps_(f.size[2]) {
        for (int layer = 0; layer < 3; ++layer) read(layer);
    }

    // Moves on to the slab of cells `i`: 3 for mixed cells (j, k), by the place of their first coefficient.
    const std::vector<uint8_t>& slab(int i) {
        read(i + 3);
        const size_t size = layer_[0].size(), row = static_cast<size_t>(taps_);
        signs_.resize(size);
        for (size_t n = 0; n < size; ++n)
            signs_[n] = layer_[0][n] | layer_[1][n] | layer_[2][n] | layer_[3][n];
        for (const size_t step : {size_t{1}, row})
            for (size_t n = 0; n + 3 * step < size; ++n)
                signs_[n] |= signs_[n + step] | signs_[n + 2 * step] | signs_[n + 3 * step];
        return signs_;
    }

 private:
    // 1 for coefficients below zero, 2 for the others.
    void read(int layer) {
        std::vector<uint8_t>& signs = layer_[layer % 4];
        signs.resize(static_cast<size_t>(rows_) * static_cast<size_t>(taps_));
        const float* c = f_.values + layer * static_cast<int64_t>(signs.size());
        for (size_t n = 0; n < signs.size(); ++n) signs[n] = c[n] < 0.0f ? 1 : 2;
    }

    const FieldView& f_;
    int rows_, taps_;
    std::vector<uint8_t> layer_[4], signs_;
};

// Collects the triangles of the slabs of cells one after the other, with vertices on the edges of tetrahedra.
class March {
 public:
    March(const FieldView& f, FieldCarrier& out) : f_(f), out_(out), low_(f, 0), high_(f, 1) {}

    void run() {
        MixedCells mixed(f_);
        for (int i = 0; i < f_.cells(0); ++i) {
            may_cancel();
            if (i > 0) low_ = std::exchange(high_, NodeSlab(f_, i + 1));
            const uint8_t* row = mixed.slab(i).data();
            for (int j = 0; j < f_.cells(1); ++j, row += f_.size[2])
                for (int k = 0; k < f_.cells(2); ++k) {
                    // Eight cells at once where none is mixed
                    uint64_t eight;
                    while (k + 8 <= f_.cells(2)) {
                        std::memcpy(&eight, row + k, sizeof eight);
                        if ((eight & eight >> 1 & 0x0101010101010101u) != 0) break;
                        k += 8;
                    }
                    if (k < f_.cells(2) && row[k] == 3) cell({i, j, k});
                }
        }
    }

 private:
    NodeSlab::Entry& node(const Node& corner, const Node& at) {
        return (corner[0] ? high_ : low_)(at[1] + corner[1], at[2] + corner[2]);
    }
    double value(const Node& corner, const Node& at) { return node(corner, at).value; }

    void cell(const Node& at) {
        int inside = 0;
        for (int c = 0; c < 8; ++c) inside += value({c & 1, c >> 1 & 1, c >> 2}, at) < 0.0;
        if (inside == 0 || inside == 8) return;
        for (const auto& path : kPaths) {
            Node corner[4] = {};
            for (int k = 0; k < 3; ++k) {
                corner[k + 1] = corner[k];
                corner[k + 1][static_cast<size_t>(path[k])] = 1;
            }
            tetrahedron(at, corner);
        }
    }

    // The vertex on the edge between two corners of a cell.
    uint32_t vertex(const Node& at, const Node& from, const Node& to) {
        const int direction = (to[0] - from[0]) + 2 * (to[1] - from[1]) + 4 * (to[2] - from[2]);
        const double a = value(from, at), b = value(to, at), part = a / (a - b);
        int64_t& known = node(from, at).vertex[static_cast<size_t>(direction - 1)];
        if (known >= 0) return static_cast<uint32_t>(known);
        known = static_cast<int64_t>(out_.point.size() / 3);
        for (size_t k = 0; k < 3; ++k) out_.point.push_back(at[k] + from[k] + part * (to[k] - from[k]));
        return static_cast<uint32_t>(known);
    }

    void tetrahedron(const Node& at, const Node (&corner)[4]) {
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
    void triangle(const Node& at, const Node (&corner)[4], std::pair<int, int> a, std::pair<int, int> b,
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

    const FieldView& f_;
    FieldCarrier& out_;
    NodeSlab low_, high_;  // nodes before and behind the slab of cells
};

template <typename Visit>
void for_blocks(int threads, int64_t count, const Visit& visit) {
    parallel_for(threads, (count + kBlock - 1) / kBlock, nullptr, [&](int, int64_t block) {
        const int64_t first = block * kBlock;
        visit(static_cast<size_t>(block), static_cast<size_t>(first),
              static_cast<size_t>(std::min(count, first + kBlock)));
    });
}

}  // namespace

FieldCarrier field_carrier(const FieldView& field, int threads) {
    FieldCarrier out;
    March(field, out).run();
    // Pull the vertices towards the surface, but not far where the gradient vanishes
    constexpr double kMostPull = 0.5;
    out.gradient.resize(out.point.size());
    for_blocks(threads, static_cast<int64_t>(out.point.size() / 3), [&](size_t, size_t first, size_t last) {
        for (size_t n = first; n < last; ++n) {
            double x[3];
            std::copy_n(&out.point[3 * n], 3, x);
            const SplineJet jet = spline_jet(field, x);
            double square = 0.0;
            for (const double g : jet.gradient) square += g * g;
            const double step = square > 0.0 ? jet.value / square : 0.0;
            if (step * step * square < kMostPull * kMostPull)
                for (size_t k = 0; k < 3; ++k) x[k] -= step * jet.gradient[k];
            std::copy_n(x, 3, &out.point[3 * n]);
            std::copy_n(spline_jet(field, x).gradient, 3, &out.gradient[3 * n]);
        }
    });
    return out;
}

bool may_end_at_its_box(const FieldView& f) {
    const auto outer = [&](int axis, int k) { return k < 3 || k >= f.size[axis] - 3; };
    const bool inside = f.values[0] < 0.0f;
    const float* at = f.values;
    for (int i = 0; i < f.size[0]; ++i)
        for (int j = 0; j < f.size[1]; ++j, at += f.size[2]) {
            const bool whole = outer(0, i) || outer(1, j);
            for (int k = 0; k < f.size[2]; k = whole || k != 2 ? k + 1 : std::max(3, f.size[2] - 3))
                if ((at[k] < 0.0f) != inside) return true;
        }
    return false;
}

FieldPatch field_patch(const FieldCarrier& carrier, size_t triangle) {
    FieldPatch out;
    for (size_t k = 0; k < 3; ++k) {
        const size_t corner = 3 * static_cast<size_t>(carrier.triangle[3 * triangle + k]);
        for (size_t c = 0; c < 3; ++c) {
            out.point[k][c] = static_cast<float>(carrier.point[corner + c]);
            out.gradient[k][c] = static_cast<float>(carrier.gradient[corner + c]);
        }
    }
    return out;
}

std::vector<float> field_outline(const FieldView& field, const FieldCarrier& carrier,
                                 const FieldViewer& viewer, int threads) {
    // The sides of all vertices: g . v at each
    const auto vertices = static_cast<int64_t>(carrier.point.size() / 3);
    std::vector<double> side(static_cast<size_t>(vertices));
    for_blocks(threads, vertices, [&](size_t, size_t first, size_t last) {
        for (size_t n = first; n < last; ++n) {
            double x[3], v[3], sum = 0.0;
            std::copy_n(&carrier.point[3 * n], 3, x);
            viewer.direction(x, v);
            for (size_t k = 0; k < 3; ++k) sum += carrier.gradient[3 * n + k] * v[k];
            side[n] = sum;
        }
    });
    // The point of the outline on the edge between two vertices, the same for both triangles of the edge
    const auto end_on = [&](uint32_t one, uint32_t other, Point& x, bool& clear) {
        const size_t a = std::min(one, other), b = std::max(one, other);
        const double part = side[a] / (side[a] - side[b]);
        double at[3];
        for (size_t k = 0; k < 3; ++k)
            at[k] = carrier.point[3 * a + k] + part * (carrier.point[3 * b + k] - carrier.point[3 * a + k]);
        const bool found = pull_to_outline(field, viewer, at, clear);
        x = {at[0], at[1], at[2]};
        return found;
    };
    const auto triangles = static_cast<int64_t>(carrier.triangle.size() / 3);
    std::vector<std::vector<float>> parts(static_cast<size_t>((triangles + kBlock - 1) / kBlock));
    for_blocks(threads, triangles, [&](size_t block, size_t first, size_t last) {
        for (size_t n = first; n < last; ++n) {
            const uint32_t* corner = &carrier.triangle[3 * n];
            bool front[3];
            for (size_t k = 0; k < 3; ++k) front[k] = side[corner[k]] >= 0.0;
            if (front[0] == front[1] && front[1] == front[2]) continue;
            const size_t lone = front[1] == front[2] ? 0 : front[0] == front[2] ? 1 : 2;
            const uint32_t top = corner[lone], left = corner[(lone + 1) % 3], right = corner[(lone + 2) % 3];
            // The tangent g x grad G has the larger G on its right, as seen from outside
            Point end[2];
            bool clear[2];
            if (!end_on(top, front[lone] ? right : left, end[0], clear[0])) continue;
            if (!end_on(top, front[lone] ? left : right, end[1], clear[1])) continue;
            if (!clear[0] && !clear[1] && !field.inside) continue;
            for (const Point& x : end) {
                const double grid[3] = {x[0], x[1], x[2]};
                double place[3];
                field.place_in_world(grid, place);
                for (const double c : place) parts[block].push_back(static_cast<float>(c));
            }
        }
    });
    std::vector<float> out;
    for (const std::vector<float>& part : parts) out.insert(out.end(), part.begin(), part.end());
    return out;
}

}  // namespace edgegrad
