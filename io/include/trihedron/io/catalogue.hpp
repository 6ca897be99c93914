#pragma once
/// The catalogue of the calibrations of one spacecraft: an SQLite database of version 2. Table `calibration` has a row
/// each, `parameter` its values and sigmas, `finding` the codes of its verdict; `calibration.json` is the whole of it,
/// and what is read back.

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "trihedron/records/catalogue.hpp"

namespace trihedron::io {

/// Entries that are added to a catalogue all or none: everything that can fail but the last step is done when it is
/// made, commit() is that step, and without it the catalogue is as it was. Makes the catalogue where there is none. A
/// calibration of the same start-up, pass, epoch, t, estimator, drift model and number of passes is replaced. A
/// start-up without a name gets that of the epoch of the first entry. Nobody else reads or writes the catalogue
/// meanwhile.
///
/// A set of files that belongs to the entries is put in place between the two (StagedDirectory), and kept after
/// commit(). Whatever fails before commit() has returned leaves both as they were, and so does a kill, after which the
/// next run takes back files that were not kept. Only a kill between commit() and keep(), a few system calls apart, or
/// a disk that fails in keep() leaves new entries beside old files; each of the two is whole, and the same command once
/// more replaces the entries and makes the files. Files that are kept before commit() would turn this round, with a
/// window as long as it takes to bring the catalogue to the disk, and could not be taken back where that fails.
class CatalogueUpdate {
 public:
  /// Throws InputRefused for a file that is no catalogue, a damaged or newer one, or one of another spacecraft;
  /// MachineFailed when it cannot be written.
  CatalogueUpdate(std::filesystem::path file, std::span<const CatalogueEntry> entries);
  CatalogueUpdate(const CatalogueUpdate&) = delete;
  CatalogueUpdate& operator=(const CatalogueUpdate&) = delete;
  ~CatalogueUpdate();
  /// Throws MachineFailed; then nothing has been added.
  void commit();

 private:
  struct Open;
  void discard() noexcept;

  std::filesystem::path file_;
  bool is_new_ = false;
  std::unique_ptr<Open> open_;
};

/// Both at once. Throws as CatalogueUpdate.
void add_to_catalogue(const std::filesystem::path& file, std::span<const CatalogueEntry> entries);

/// Checks, before a long calculation, that the file is absent or a catalogue of this spacecraft, and that it can be
/// written now. Throws as CatalogueUpdate.
void expect_catalogue_of(const std::string& spacecraft, const std::filesystem::path& file);

/// In the order of epoch, and then t and number of passes. Throws as CatalogueUpdate, and InputRefused where there is
/// none.
[[nodiscard]] std::vector<CatalogueEntry> read_catalogue(const std::filesystem::path& file);

}  // namespace trihedron::io
