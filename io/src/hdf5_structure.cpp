#include "hdf5_structure.hpp"

#include <fmt/format.h>
#include <hdf5.h>

#include <algorithm>
#include <set>
#include <string>
#include <string_view>

#include "input_file.hpp"
#include "trihedron/io/error.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace {

constexpr std::size_t kMostLinks = 10'000;
constexpr std::ptrdiff_t kDeepest = 16;

/// An identifier of HDF5, negative where there is none.
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  ~Handle() {
    if (id_ >= 0) {
      close_(id_);
    }
  }
  [[nodiscard]] hid_t id() const { return id_; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

/// What was met on the way, and what is wrong with it; empty where nothing is.
struct Walk {
  std::set<haddr_t> met;
  std::string fault;
};

/// Empty where the data of the object, if it has any, are in this file.
std::string_view fault_of_data(hid_t root, const char* name) {
  const Handle object(H5Oopen(root, name, H5P_DEFAULT), H5Oclose);
  if (object.id() < 0) {
    return "cannot be opened";
  }
  if (H5Iget_type(object.id()) != H5I_DATASET) {
    return {};
  }
  const Handle layout(H5Dget_create_plist(object.id()), H5Pclose);
  if (layout.id() < 0) {
    return "cannot be opened";
  }
  return H5Pget_external_count(layout.id()) != 0 || H5Pget_layout(layout.id()) == H5D_VIRTUAL
             ? "has its data in another file"
             : "";
}

std::string_view fault_of_link(hid_t root, const char* name, const H5L_info_t& link, Walk& walk) {
  if (link.type != H5L_TYPE_HARD) {
    return "is a symbolic link";
  }
  if (!walk.met.insert(link.u.address).second) {
    return "is linked more than once";
  }
  if (walk.met.size() > kMostLinks) {
    return "is one object too many";
  }
  if (std::ranges::count(std::string_view(name), '/') >= kDeepest) {
    return "is nested too deeply";
  }
  return fault_of_data(root, name);
}

/// Called by HDF5 for each link of each group, before it goes into the object that is linked.
herr_t look_at(hid_t root, const char* name, const H5L_info_t* link, void* data) {
  constexpr herr_t kGoOn = 0;
  constexpr herr_t kEnough = 1;
  constexpr herr_t kFailed = -1;
  try {
    auto& walk = *static_cast<Walk*>(data);
    if (const std::string_view fault = fault_of_link(root, name, *link, walk); !fault.empty()) {
      walk.fault = fmt::format("{} {}", in_quotes(name), fault);
    }
    return walk.fault.empty() ? kGoOn : kEnough;
  } catch (...) {
    return kFailed;
  }
}

}  // namespace

void prepare_hdf5() {
  [[maybe_unused]] static const herr_t once = H5dont_atexit();
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

void check_hdf5_structure(const std::filesystem::path& path) {
  static_cast<void>(InputFile(path));
  prepare_hdf5();
  const Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  if (file.id() < 0) {
    throw InputRefused(path, {}, "is no NetCDF-4 file that can be read", kGiveAPass);
  }
  Walk walk;
  H5O_info_t root{};
  herr_t status = H5Oget_info_by_name(file.id(), "/", &root, H5P_DEFAULT);
  if (status >= 0) {
    walk.met.insert(root.addr);
    status = H5Lvisit(file.id(), H5_INDEX_NAME, H5_ITER_NATIVE, look_at, &walk);
  }
  if (!walk.fault.empty()) {
    throw InputRefused(path, {}, fmt::format("is no tree of groups and data: {}", walk.fault),
                       "write it as `trihedron simulate` does");
  }
  if (status < 0) {
    throw InputRefused(path, {}, "is a damaged NetCDF-4 file", "get it again");
  }
}

}  // namespace trihedron::io
