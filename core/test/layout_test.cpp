#include "trihedron/core/layout.hpp"

#include <gtest/gtest.h>

#include <array>

namespace trihedron {
namespace {

constexpr DriftModelId kEachDriftModel[] = {kEsg7, kEsg20, vsh(1), vsh(2), vsh(3), vsh(4), vsh(5), vsh(6)};
constexpr int kSets = 256;  // of further states

FurtherStates set_of_further_states(int number) {
  return {.wandering_drift = (number & 1) != 0,
          .readout_bias = (number & 2) != 0,
          .coefficient_change = (number & 4) != 0,
          .clock_offset = (number & 8) != 0,
          .orbital_error = (number & 16) != 0,
          .clock_rate = (number & 32) != 0,
          .orbital_drift = (number & 64) != 0,
          .polhode = (number & 128) != 0};
}

/// Whether `predicate` holds for every layout that there is.
template <class Predicate>
bool for_every_layout(Predicate predicate) {
  for (int gyros = 2; gyros <= kMaxGyros; ++gyros) {
    for (const DriftModelId model : kEachDriftModel) {
      for (int set = 0; set < kSets; ++set) {
        for (int heads = 1; heads <= kMaxStarTrackers; ++heads) {
          if (!predicate(Layout{gyros, model, set_of_further_states(set), heads})) {
            return false;
          }
        }
      }
    }
  }
  return true;
}

/// How often each position is taken.
struct Places {
  std::array<int, kFullCapacity.states> taken{};
  bool outside = false;
  void take(int first, int size, int of) {
    for (int i = first; i < first + size; ++i) {
      if (i < 0 || i >= of) {
        outside = true;
      } else {
        ++taken[static_cast<std::size_t>(i)];
      }
    }
  }
};

bool positions_fill_without_overlap(const Layout& layout) {
  Places places;
  const int size = layout.size();
  for (int k = 0; k < layout.gyros; ++k) {
    places.take(layout.direction(k), layout.direction_size, size);
    places.take(layout.drift(k), layout.drift_size(), size);
    places.take(layout.alignment(k), 3, size);
  }
  for (const FurtherStateKind& kind : kFurtherStateKinds) {
    if (layout.has(kind.state)) {
      for (int owner = layout.owners(kind.state).begin; owner < layout.owners(kind.state).end; ++owner) {
        places.take(layout.first(kind.state, owner), kind.size, size);
      }
    }
  }
  for (int i = 0; i < size; ++i) {
    if (places.taken[static_cast<std::size_t>(i)] != 1) {
      return false;
    }
  }
  return !places.outside;
}
bool parts_are_in_their_order(const Layout& layout) {
  const int last = layout.gyros - 1;
  // What moves, then the parameters, then what else the gyros have, then what they share.
  return layout.direction(0) == 0 && layout.dynamic() >= layout.direction(layout.gyros) &&
         layout.drift(0) == layout.dynamic() && layout.drift(0) + layout.parameters() == layout.behind_parameters() &&
         layout.alignment(last) + 3 == layout.behind_parameters() &&
         layout.drift(0) + layout.drift_parameters() == layout.readout(0) &&
         layout.amplitudes() == layout.behind_parameters() &&
         layout.amplitudes() + layout.amplitudes_size() == layout.readout(0) && layout.readout(0) <= layout.shared() &&
         layout.shared() + layout.shared_size() == layout.size() &&
         layout.dynamic() + layout.constants() == layout.size();
}

bool columns_of_drift_fill(const Layout& layout) {
  const int wandering = layout.further.wandering_drift ? 3 : 0;
  const int change = layout.further.coefficient_change ? Layout::kEq1 : 0;
  const int orbital = layout.further.orbital_drift ? 6 : 0;
  const int polhode = layout.further.polhode ? 2 * Layout::kEq1 : 0;
  return layout.wandering_column() == layout.drift_size() &&
         layout.change_column() == layout.drift_size() + wandering &&
         layout.orbital_column() == layout.change_column() + change &&
         layout.polhode_column() == layout.orbital_column() + orbital &&
         layout.drift_columns() == layout.polhode_column() + polhode;
}

bool blocks_are_those_of_their_states(const Layout& layout) {
  constexpr FurtherState kStates[] = {FurtherState::kCoefficientChange, FurtherState::kOrbitalDrift,
                                      FurtherState::kPolhode};
  for (int k = 0; k < layout.gyros; ++k) {
    int column = layout.change_column();
    for (std::size_t i = 0; i < 3; ++i) {
      const Layout::Block block = layout.beside_kappa(k)[i];
      const FurtherState state = kStates[i];
      const bool is_there = layout.has(state);
      if (block.size != (is_there ? kind_of(state).size : 0) ||
          (is_there && (block.state != layout.first(state, k) || block.column != column)) ||
          block.state + block.size > layout.size() || block.column + block.size > layout.drift_columns()) {
        return false;
      }
      column += block.size;
    }
  }
  return true;
}

// Each kind has one row, in the order of the enumeration.
constexpr bool rows_are_in_order() {
  for (std::size_t i = 0; i < kFurtherStateCount; ++i) {
    if (static_cast<std::size_t>(kFurtherStateKinds[i].state) != i) {
      return false;
    }
  }
  return true;
}
static_assert(rows_are_in_order());

// The paper's 24 states, and one component more of each direction.
static_assert(Layout{}.size() == 26 && Layout{}.parameters() == 20);
static_assert(Layout{.direction_size = 2}.size() == 24);

TEST(Layout, FillsItsPositionsWithoutOverlap) { EXPECT_TRUE(for_every_layout(positions_fill_without_overlap)); }

TEST(Layout, HasBlocksBesideTheCoefficientsWhereTheirStatesAre) {
  EXPECT_TRUE(for_every_layout(blocks_are_those_of_their_states));
}

TEST(Layout, HasColumnsOfDriftOneAfterAnother) { EXPECT_TRUE(for_every_layout(columns_of_drift_fill)); }

TEST(Layout, HasItsPartsInTheirOrder) { EXPECT_TRUE(for_every_layout(parts_are_in_their_order)); }

TEST(Layout, OfDriftModesHasEquation1AndThese) {
  for (const int modes : {0, 5}) {
    const Layout layout{.drift_model = kEsg20, .further = {.wandering_drift = true}, .drift_modes = modes};
    EXPECT_EQ(layout.drift_size(), Layout::kEq1 + modes);
    EXPECT_EQ(layout.wandering_column(), Layout::kEq1 + modes);
    EXPECT_EQ(layout.parameters(), 2 * (Layout::kEq1 + modes + 3));
    EXPECT_TRUE(positions_fill_without_overlap(layout));
  }
}

TEST(Capacity, OfALayoutHoldsIt) {
  EXPECT_TRUE(for_every_layout([](const Layout& layout) { return Capacity::of(layout).holds(layout); }));
  EXPECT_TRUE(for_every_layout([](const Layout& layout) { return kFullCapacity.holds(layout); }));
}

TEST(Capacity, OfAPairHoldsEq1Alone) {
  EXPECT_TRUE(
      for_every_layout([](const Layout& layout) { return kPairCapacity.holds(layout) == (layout == Layout{}); }));
}

TEST(Capacity, HoldsWhatHasRoomInEachRespect) {
  const Layout three{.gyros = 3};
  const Capacity room = Capacity::of(three);
  EXPECT_TRUE(room.holds(three));
  EXPECT_TRUE(room.holds({}));
  Layout layout = three;
  layout.gyros = 4;
  EXPECT_FALSE(room.holds(layout));
  // Fewer states, but more columns of drift.
  layout = {.drift_model = vsh(1)};
  EXPECT_LT(layout.size(), three.size());
  EXPECT_FALSE(room.holds(layout));
  layout = {.star_trackers = 2};
  EXPECT_LT(layout.size(), three.size());
  EXPECT_FALSE(room.holds(layout));
  layout = three;
  layout.further.clock_offset = true;
  EXPECT_FALSE(room.holds(layout));
  // Fewer states and no more columns, but more of the states move.
  const Capacity room_of_columns = Capacity::of({.gyros = 3, .drift_model = vsh(1)});
  layout = {.further = {.wandering_drift = true}};
  EXPECT_LE(layout.drift_columns(), room_of_columns.drift_columns);
  EXPECT_LE(layout.size(), room_of_columns.states);
  EXPECT_FALSE(room_of_columns.holds(layout));
  // Nor what is no layout.
  for (const int gyros : {-1, 0, 1}) {
    layout = three;
    layout.gyros = gyros;
    EXPECT_FALSE(room.holds(layout)) << gyros;
  }
  layout = three;
  layout.star_trackers = 0;
  EXPECT_FALSE(room.holds(layout));
  EXPECT_FALSE(
      kFullCapacity.holds({.drift_model = vsh(DriftModelId::kMaxDegreeOnBoard + 1), .further = kAllFurtherStates}));
}

TEST(Layout, HasNothingOfWhatIsOff) {
  const Layout plain;
  for (const FurtherStateKind& kind : kFurtherStateKinds) {
    EXPECT_FALSE(plain.has(kind.state));
    EXPECT_TRUE(kLargestLayout.has(kind.state));
    if (kind.flag != nullptr) {
      Layout with;
      with.further.*kind.flag = true;
      const Layout::Owners owners = with.owners(kind.state);
      EXPECT_EQ(with.size() - plain.size(), (owners.end - owners.begin) * kind.size);
    }
  }
}

}  // namespace
}  // namespace trihedron
