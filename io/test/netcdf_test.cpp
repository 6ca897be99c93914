#include <gmock/gmock.h>
#include <hdf5.h>
#include <netcdf.h>
#include <sys/stat.h>

#include <cmath>
#include <cstdlib>
#include <limits>

#include "fixtures.hpp"
#include "netcdf_file.hpp"
#include "trihedron/io/campaign.hpp"
#include "trihedron/io/pass.hpp"
#include "trihedron/io/residuals.hpp"

namespace trihedron::io {
namespace {

using testing::HasSubstr;

class PassNetcdf : public testing::Test {
 protected:
  PassNetcdf() { raw_.save_netcdf(file()); }

  [[nodiscard]] std::filesystem::path file() const { return directory_ / "pass.nc"; }
  [[nodiscard]] std::string read_refused() const {
    return refusal([&] { static_cast<void>(read_pass(file())); });
  }
  /// Changes the file with the library's own calls; `change` gets its id.
  template <class Change>
  void change(Change change) const {
    int id = 0;
    ASSERT_EQ(nc_open(file().c_str(), NC_WRITE, &id), NC_NOERR);
    nc_redef(id);
    change(id);
    ASSERT_EQ(nc_close(id), NC_NOERR);
  }
  static int group(int id, const char* name) {
    int found = 0;
    EXPECT_EQ(nc_inq_ncid(id, name, &found), NC_NOERR);
    return found;
  }
  static int variable(int group_id, const char* name) {
    int found = 0;
    EXPECT_EQ(nc_inq_varid(group_id, name, &found), NC_NOERR);
    return found;
  }
  static void put_text(int id, int variable_id, const char* name, std::string_view text) {
    EXPECT_EQ(nc_put_att_text(id, variable_id, name, text.size(), text.data()), NC_NOERR);
  }

  TemporaryDirectory directory_;
  RawPass raw_ = clean_pass();
};

// Rows that were declared and never written take no room in the file, and would take all memory.
TEST_F(PassNetcdf, RefusesMoreRowsThanTheFileCanHold) {
  int id = 0;
  const auto pass_toml = raw_.toml;
  ASSERT_EQ(nc_create(file().c_str(), NC_NETCDF4 | NC_CLOBBER, &id), NC_NOERR);
  put_text(id, NC_GLOBAL, "pass_toml", pass_toml);
  int gyro = 0;
  int time = 0;
  int column = 0;
  ASSERT_EQ(nc_def_grp(id, "gyro", &gyro), NC_NOERR);
  ASSERT_EQ(nc_def_dim(gyro, "time", 100'000'000, &time), NC_NOERR);
  for (const char* name : {"t_s", "h1_x", "h1_y", "h1_z", "h2_x", "h2_y", "h2_z"}) {
    ASSERT_EQ(nc_def_var(gyro, name, NC_DOUBLE, 1, &time, &column), NC_NOERR);
    ASSERT_EQ(nc_def_var_deflate(gyro, column, 0, 1, 1), NC_NOERR);
  }
  ASSERT_EQ(nc_close(id), NC_NOERR);
  EXPECT_THAT(read_refused(), HasSubstr("group \"gyro\" declares 100000000 rows, more than a file of "));
}

TEST_F(PassNetcdf, ReadsPlainDoublesAsTheCsvReaderReadsText) {
  raw_.save_directory(directory_ / "csv");
  expect_same_pass(read_pass(file()).pass, read_pass(directory_ / "csv").pass, 0, 0);
}

TEST_F(PassNetcdf, RoundTripsThroughPackedCosinesWithinHalfAStep) {
  Pass pass = read_pass(file()).pass;
  pass.gyro.h[4] = kNaN;
  pass.settings.start_up = "2009-05-20";
  pass.settings.prior = sample_calibration();
  write_pass(directory_ / "copy.nc", pass, nullptr);
  const LoadedPass copy = read_pass(directory_ / "copy.nc");
  expect_same_pass(pass, copy.pass, 2.501e-10, 0);
  EXPECT_EQ(only(copy.defects, Defect::Kind::kMissingValue).count, 1);
  ASSERT_TRUE(copy.pass.settings.prior.has_value());
  EXPECT_EQ(copy.pass.settings.prior->covariance, sample_calibration().covariance);
}

/// Other programs may add to what this one wrote: that takes the order of creation, which not every way of writing
/// keeps.
TEST_F(PassNetcdf, WrittenFileCanBeAddedToAndKeepsTheOrderOfItsVariables) {
  write_pass(file(), read_pass(file()).pass, nullptr);
  change([](int id) {
    put_text(id, NC_GLOBAL, "history", "looked at");
    EXPECT_EQ(variable(group(id, "star_tracker"), "t_s"), 0);
    EXPECT_EQ(variable(group(id, "star_tracker"), "q_w"), 4);
  });
  EXPECT_EQ(read_refused(), "");
}

TEST_F(PassNetcdf, CoarserStepMakesASmallerFileAndARougherOne) {
  const Pass pass = read_pass(file()).pass;
  write_pass(directory_ / "fine.nc", pass, nullptr);
  write_pass(directory_ / "coarse.nc", pass, nullptr, {.direction_step = 1e-6});
  EXPECT_LT(std::filesystem::file_size(directory_ / "coarse.nc"), std::filesystem::file_size(directory_ / "fine.nc"));
  expect_same_pass(pass, read_pass(directory_ / "coarse.nc").pass, 5.01e-7, 0);
}

TEST_F(PassNetcdf, CoarserStepMakesASmallerFileOfALongPassToo) {
  Pass pass = read_pass(file()).pass;
  const GyroTelemetry once = pass.gyro;
  while (pass.gyro.size() < 20'000) {
    pass.gyro.t.push_back(pass.gyro.t.back() + pass.settings.gyro_period);
    const std::size_t row = (pass.gyro.size() * 7919) % once.size();  // jumps, as noise makes them
    const auto begin = once.h.begin() + static_cast<std::ptrdiff_t>(row * 6);
    pass.gyro.h.insert(pass.gyro.h.end(), begin, begin + 6);
  }
  pass.gyro.h.resize(pass.gyro.size() * 6);
  pass.settings.duration = pass.gyro.t.back() - pass.settings.epoch;
  write_pass(directory_ / "fine.nc", pass, nullptr);
  write_pass(directory_ / "coarse.nc", pass, nullptr, {.direction_step = 1e-4});
  EXPECT_LT(2 * std::filesystem::file_size(directory_ / "coarse.nc"),
            std::filesystem::file_size(directory_ / "fine.nc"));
  expect_same_pass(pass, read_pass(directory_ / "fine.nc").pass, 2.51e-10, 0);
}

TEST_F(PassNetcdf, ValuesThatCannotBePackedAreNotLost) {
  Pass pass = read_pass(file()).pass;
  pass.gyro.h[0] = 17.25;
  pass.gyro.h[1] = std::numeric_limits<double>::infinity();
  write_pass(directory_ / "copy.nc", pass, nullptr);
  const Pass copy = read_pass(directory_ / "copy.nc").pass;
  EXPECT_EQ(copy.gyro.h[0], 17.25);
  EXPECT_EQ(copy.gyro.h[1], std::numeric_limits<double>::infinity());
}

TEST_F(PassNetcdf, CsvAndNetcdfCarryTheSamePass) {
  const Pass pass = read_pass(file()).pass;
  write_pass(directory_ / "a", pass, nullptr);
  write_pass(directory_ / "b.nc", read_pass(directory_ / "a").pass, nullptr);
  write_pass(directory_ / "c", read_pass(directory_ / "b.nc").pass, nullptr);
  for (const char* name : {"pass.toml", "gyro.csv", "star_tracker.csv"}) {
    EXPECT_EQ(read_text(directory_ / "a" / name), read_text(directory_ / "c" / name)) << name;
  }
}

TEST_F(PassNetcdf, PriorIsLookedUpBesideTheFile) {
  raw_.toml = "prior = \"none.json\"\n" + raw_.toml;
  raw_.save_netcdf(file());
  EXPECT_THAT(read_refused(), HasSubstr((directory_ / "none.json").string() + ": cannot be opened"));
}

TEST_F(PassNetcdf, RefusesAFileThatIsNoNetcdf) {
  write_text(file(), "t_s,h1_x\n");
  EXPECT_THAT(read_refused(), HasSubstr("pass.nc: is no NetCDF-4 file that can be read"));
  write_text(file(), "");
  EXPECT_THAT(read_refused(), HasSubstr("pass.nc: is no NetCDF-4 file that can be read"));
}

TEST_F(PassNetcdf, RefusesAFileThatIsCutShort) {
  std::filesystem::resize_file(file(), std::filesystem::file_size(file()) / 2);
  EXPECT_THAT(read_refused(), HasSubstr("pass.nc: is no NetCDF-4 file that can be read"));
}

TEST_F(PassNetcdf, RefusesAFileWithoutGroups) {
  const auto of_format = [&](int format) {
    int id = 0;
    EXPECT_EQ(nc_create(file().c_str(), NC_CLOBBER | format, &id), NC_NOERR);
    put_text(id, NC_GLOBAL, "pass_toml", raw_.toml);
    EXPECT_EQ(nc_close(id), NC_NOERR);
    return read_refused();
  };
  EXPECT_THAT(of_format(NC_NETCDF4), HasSubstr("pass.nc: lacks group \"gyro\""));
  EXPECT_THAT(of_format(NC_CLASSIC_MODEL), HasSubstr("pass.nc: is no NetCDF-4 file"));
}

TEST_F(PassNetcdf, RefusesTheNameOfADirectoryOrAFifo) {
  std::filesystem::remove(file());
  ASSERT_EQ(::mkfifo(file().c_str(), 0600), 0);
  EXPECT_THAT(read_refused(), HasSubstr("pass.nc: is a FIFO, not a regular file"));
  std::filesystem::remove(file());
  std::filesystem::create_directory(file());
  EXPECT_THAT(refusal([&] { static_cast<void>(NetcdfReader(file())); }), HasSubstr("is a directory"));
}

TEST_F(PassNetcdf, RefusesLinksThatMakeItMoreThanATree) {
  const auto with_link = [&](auto link) {
    raw_.save_netcdf(file());
    const hid_t id = H5Fopen(file().c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    EXPECT_GE(link(id), 0);
    EXPECT_GE(H5Fclose(id), 0);
    return read_refused();
  };
  const std::string file_name = file().string();
  EXPECT_THAT(
      with_link([](hid_t id) { return H5Lcreate_hard(id, "/gyro", id, "/gyro/again", H5P_DEFAULT, H5P_DEFAULT); }),
      HasSubstr("is no tree of groups and data: \"gyro/again\" is linked more than once"));
  EXPECT_THAT(with_link([](hid_t id) { return H5Lcreate_hard(id, "/", id, "/gyro/root", H5P_DEFAULT, H5P_DEFAULT); }),
              HasSubstr("\"gyro/root\" is linked more than once"));
  EXPECT_THAT(with_link([](hid_t id) { return H5Lcreate_soft("/gyro", id, "/gyro/again", H5P_DEFAULT, H5P_DEFAULT); }),
              HasSubstr("\"gyro/again\" is a symbolic link"));
  EXPECT_THAT(with_link([&](hid_t id) {
                return H5Lcreate_external(file_name.c_str(), "/gyro", id, "/other", H5P_DEFAULT, H5P_DEFAULT);
              }),
              HasSubstr("\"other\" is a symbolic link"));
  EXPECT_THAT(with_link([](hid_t id) {
                std::string name;
                herr_t status = 0;
                for (int depth = 0; depth < 20 && status >= 0; ++depth) {
                  name += "/deeper";
                  const hid_t deeper = H5Gcreate2(id, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
                  status = H5Gclose(deeper);
                }
                return status;
              }),
              HasSubstr("is nested too deeply"));
}

TEST_F(PassNetcdf, RefusesDataOfAnotherFile) {
  const std::string secret = directory_ / "secret";
  write_text(secret, std::string(80, 'x'));
  const hid_t id = H5Fopen(file().c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  const hsize_t size = 10;
  const hid_t space = H5Screate_simple(1, &size, nullptr);
  const hid_t layout = H5Pcreate(H5P_DATASET_CREATE);
  EXPECT_GE(H5Pset_external(layout, secret.c_str(), 0, 80), 0);
  const hid_t data = H5Dcreate2(id, "/gyro/stolen", H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, layout, H5P_DEFAULT);
  EXPECT_GE(data, 0);
  H5Dclose(data);
  H5Pclose(layout);
  H5Sclose(space);
  EXPECT_GE(H5Fclose(id), 0);
  EXPECT_THAT(read_refused(), HasSubstr("\"gyro/stolen\" has its data in another file"));
}

TEST_F(PassNetcdf, RefusesUnitsOfPureNumbers) {
  const auto with_units = [&](const char* of_group, const char* name, std::string_view units) {
    raw_.save_netcdf(file());
    change([&](int id) { put_text(group(id, of_group), variable(group(id, of_group), name), "units", units); });
    return read_refused();
  };
  EXPECT_EQ(with_units("gyro", "h1_x", "1"), "");
  EXPECT_EQ(with_units("gyro", "h1_x", ""), "");
  EXPECT_THAT(with_units("gyro", "h2_y", "degree"),
              HasSubstr("pass.nc: group \"gyro\": h2_y has units \"degree\"; direction cosines and quaternions have "
                        "none: convert the values"));
  EXPECT_THAT(with_units("star_tracker", "q_w", "rad"), HasSubstr("group \"star_tracker\": q_w has units \"rad\""));
}

TEST_F(PassNetcdf, ReadsAnAttributeThatIsAStringOfNothing) {
  const hid_t id = H5Fopen(file().c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  EXPECT_GE(H5Adelete(id, "pass_toml"), 0);
  const hid_t space = H5Screate(H5S_SCALAR);
  const hid_t type = H5Tcopy(H5T_C_S1);
  EXPECT_GE(H5Tset_size(type, H5T_VARIABLE), 0);
  const hid_t attribute = H5Acreate2(id, "pass_toml", type, space, H5P_DEFAULT, H5P_DEFAULT);
  EXPECT_GE(attribute, 0);  // never written
  H5Aclose(attribute);
  H5Tclose(type);
  H5Sclose(space);
  EXPECT_GE(H5Fclose(id), 0);
  EXPECT_THAT(read_refused(), HasSubstr("pass_toml"));
}

TEST_F(PassNetcdf, RefusesMissingOrWrongSettings) {
  change([](int id) { nc_del_att(id, NC_GLOBAL, "pass_toml"); });
  EXPECT_THAT(read_refused(), HasSubstr("pass.nc: lacks the attribute \"pass_toml\""));
  change([](int id) {
    const int number = 1;
    nc_put_att_int(id, NC_GLOBAL, "pass_toml", NC_INT, 1, &number);
  });
  EXPECT_THAT(read_refused(), HasSubstr("attribute \"pass_toml\" is not text"));
  change([](int id) { put_text(id, NC_GLOBAL, "pass_toml", "[pass]\nepoch = 1\n"); });
  EXPECT_THAT(read_refused(),
              HasSubstr("pass.nc:pass_toml:2:1: key \"epoch\" is not known in [pass]; did you mean \"epoch_tai\"?"));
}

TEST_F(PassNetcdf, RefusesMissingAndUnknownVariables) {
  raw_.gyro.columns[6] = "h2_w";
  raw_.save_netcdf(file());
  EXPECT_THAT(read_refused(), HasSubstr("pass.nc:gyro: column \"h2_w\" is not known; did you mean \"h2_"));
  raw_ = clean_pass();
  raw_.star_tracker.columns.pop_back();
  raw_.save_netcdf(file());
  EXPECT_THAT(read_refused(), HasSubstr("pass.nc:star_tracker: lacks column \"q_w\""));
}

TEST_F(PassNetcdf, RefusesAMissingTimeColumn) {
  for (auto& row : raw_.star_tracker.rows) {
    row.erase(row.begin());
  }
  raw_.star_tracker.columns.erase(raw_.star_tracker.columns.begin());
  raw_.save_netcdf(file());
  EXPECT_THAT(read_refused(), HasSubstr("pass.nc:star_tracker: lacks column \"t_s\""));
}

TEST_F(PassNetcdf, RefusesWrongDimensionsAndTypes) {
  raw_.save_netcdf(file(), "sample");
  EXPECT_THAT(read_refused(), HasSubstr("group \"gyro\" lacks dimension \"time\""));

  raw_.star_tracker.columns.pop_back();
  const auto with_other_q_w = [&](nc_type type, bool along_time) {
    raw_.save_netcdf(file());
    change([&](int id) {
      const int fixes = group(id, "star_tracker");
      int dimension = 0;
      int ignored = 0;
      nc_inq_dimid(fixes, "time", &dimension);
      EXPECT_EQ(nc_def_var(fixes, "q_w", type, along_time ? 1 : 0, &dimension, &ignored), NC_NOERR);
    });
    return read_refused();
  };
  EXPECT_THAT(with_other_q_w(NC_DOUBLE, false), HasSubstr("variable \"q_w\" is not along dimension \"time\" alone"));
  EXPECT_THAT(with_other_q_w(NC_STRING, true), HasSubstr("variable \"q_w\" does not hold numbers"));
}

TEST_F(PassNetcdf, CoordinateOfTheDimensionIsPassedOver) {
  raw_.gyro.columns.insert(raw_.gyro.columns.begin(), "time");
  for (auto& row : raw_.gyro.rows) {
    row.insert(row.begin(), row[0]);
  }
  raw_.save_netcdf(file());
  EXPECT_EQ(read_refused(), "");
}

TEST_F(PassNetcdf, RefusesPackingThatIsNoNumber) {
  change([](int id) { put_text(group(id, "gyro"), variable(group(id, "gyro"), "h1_x"), "scale_factor", "small"); });
  EXPECT_THAT(read_refused(), HasSubstr("attribute \"scale_factor\" is not a number"));
}

TEST_F(PassNetcdf, TimeUnitsMustBeSecondsSinceTheEpochOfThePass) {
  const auto with_units = [&](std::string_view units) {
    change([&](int id) { put_text(group(id, "gyro"), variable(group(id, "gyro"), "t_s"), "units", units); });
    return read_refused();
  };
  EXPECT_EQ(with_units("seconds"), "");
  EXPECT_EQ(with_units("seconds since 2009-05-20T00:00:00"), "");
  EXPECT_EQ(with_units("seconds since 2009-05-20 00:00:00"), "");
  EXPECT_EQ(with_units("seconds since 2009-05-20"), "");
  EXPECT_THAT(with_units("seconds since 2010-05-20"),
              HasSubstr("group \"gyro\": t_s has units \"seconds since 2010-05-20\"; they must be \"seconds since "
                        "2009-05-20T00:00:00\""));
  EXPECT_NE(with_units("milliseconds since 2009-05-20"), "");
  EXPECT_NE(with_units("seconds since never"), "");
}

TEST_F(PassNetcdf, RefusesBrokenTruth) {
  const Pass pass = read_pass(file()).pass;
  const Truth truth = clean_truth();
  write_pass(file(), pass, &truth);
  change([](int id) { put_text(group(id, "truth"), NC_GLOBAL, "truth_json", "{"); });
  EXPECT_THAT(refusal([&] { static_cast<void>(read_truth(file())); }),
              HasSubstr("pass.nc:truth_json:1:2: is not valid JSON"));
  change([](int id) { nc_del_att(group(id, "truth"), NC_GLOBAL, "truth_json"); });
  EXPECT_THAT(refusal([&] { static_cast<void>(read_truth(file())); }), HasSubstr("lacks the attribute \"truth_json\""));
}

TEST(Residuals, ColumnsMustBeAsLongAsTheirTable) {
  const TemporaryDirectory directory;
  const Table table{"fixes", {Time{}}, {{"a", "rad", "a", {}}}};
  EXPECT_THROW(write_residuals(directory / "r.nc", Time{}, {&table, 1}), std::invalid_argument);
  EXPECT_THAT(directory.names(), testing::IsEmpty());
}

/// Runs the script beside this test; exit status 77 says that Python or xarray is not there.
TEST(Xarray, OpensEveryGroupWithItsUnitsAndTimes) {
  const TemporaryDirectory directory;
  const RawPass raw = clean_pass();
  raw.save_netcdf(directory / "raw.nc");
  Pass pass = read_pass(directory / "raw.nc").pass;
  pass.gyro.h[0] = kNaN;
  Truth truth = clean_truth();
  write_pass(directory / "pass.nc", pass, &truth);
  const Time epoch = pass.settings.epoch;
  const std::vector<Table> tables = {
      {"fixes", {epoch, epoch + std::chrono::seconds(3)}, {{"nis", "1", "NIS", {4.5, kNaN}}}},
      {"empty", {}, {{"a", "rad", "nothing", {}}}}};
  write_residuals(directory / "residuals.nc", epoch, tables);
  const std::string command = "/usr/bin/python3 " TRIHEDRON_XARRAY_CHECK " " + (directory / "pass.nc").string() + " " +
                              (directory / "residuals.nc").string();
  const int status = std::system(command.c_str());
  EXPECT_EQ(status, 0);
}

TEST_F(PassNetcdf, TheTableOfRunsSaysWhichInputsAreSettings) {
  CampaignPlan plan;
  plan.inputs.resize(2);
  plan.inputs[0].key = "gyro.readout.noise";
  plan.inputs[1].key = "calibration.gate";
  RunRecord record;
  record.draws = {1, 2};
  write_run_table(directory_ / "runs.nc", plan, "digest", {&record, 1});
  int id = 0;
  ASSERT_EQ(nc_open((directory_ / "runs.nc").c_str(), NC_NOWRITE, &id), NC_NOERR);
  const auto long_name = [&](const char* name) {
    std::size_t length = 0;
    EXPECT_EQ(nc_inq_attlen(id, variable(id, name), "long_name", &length), NC_NOERR);
    std::string text(length, '\0');
    EXPECT_EQ(nc_get_att_text(id, variable(id, name), "long_name", text.data()), NC_NOERR);
    return text;
  };
  EXPECT_EQ(long_name("input_gyro_readout_noise"), "gyro.readout.noise of the scenario");
  EXPECT_EQ(long_name("input_calibration_gate"), "calibration.gate, a setting of the calibration");
  ASSERT_EQ(nc_close(id), NC_NOERR);
}

}  // namespace
}  // namespace trihedron::io
